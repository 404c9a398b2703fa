"""Reference pages as Markdown, read off the code: commands from the command line, settings from their classes.

Every import of the documented classes stands in this file.
"""

import inspect
import json
import re
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import sealtwin
from digitise.robots.cell import RobotCell
from sealtwin.cli.app import app
from sealtwin.core.settings import Settings
from sealtwin.core.settings_text import allowed, described, meaning
from sealtwin.study.study_file import Study
from sealtwin.trial.trial_file import Trial

FILES: dict[str, type[Settings]] = {"trial": Trial, "study": Study, "cell": RobotCell}
"""Kinds of TOML file that a user writes."""
SPECIAL = re.compile(r"([\\*_\[\]<>$#])")
CODE = re.compile(r"(`+[^`]+`+)")
LITERAL = re.compile(r'"[^"]*"|\b(?:true|false)\b')


def commands_text() -> str:
    """Every command with its arguments and options."""
    from typer.main import get_command

    groups: Any = get_command(app)
    commands = {
        f"{name} {inner}".strip(): command
        for name, group in groups.commands.items()
        for inner, command in getattr(group, "commands", {"": group}).items()
    }
    parts = []
    for name, command in commands.items():
        context = command.make_context(f"sealtwin {name}", [], resilient_parsing=True)
        usage = " ".join(["sealtwin", name, *command.collect_usage_pieces(context)])
        anchor, text = name.replace(" ", "-"), _help(command.help or "")
        parts.append(f"{{#command-{anchor}}}\n## sealtwin {name}\n\n```text\n{usage}\n```\n\n{text}\n")
        parts.extend(_parameter(parameter, context) for parameter in command.params)
    return "\n".join(parts)


def settings_text(kind: str) -> str:
    """The settings of one kind of file, a section for each table."""
    root = FILES[kind]
    parts = ["## At the top of the file", "", *_entries(root)]
    for heading, repeated, settings in tables_of(root):
        brackets = f"[[{heading}]]" if repeated else f"[{heading}]"
        slug = heading.replace(".", "-").replace("_", "-")
        parts += [f"{{#setting-{kind}-{slug}}}", f"## `{brackets}`", "", escaped(meaning(settings)), ""]
        parts += _entries(settings)
    return "\n".join(parts)


def python_text() -> str:
    """The public names of ``sealtwin`` as Markdown around autodoc's directives, grouped by what they are."""
    groups: dict[str, list[str]] = {"Functions": [], "Settings": [], "Results": [], "Errors": []}
    for name in getattr(sealtwin, "__all__", ()):
        value = getattr(sealtwin, name)
        if not inspect.isclass(value):
            groups["Functions"].append(f".. autofunction:: sealtwin.{name}")
        elif issubclass(value, Settings):
            # Its docstring lists the keywords; pydantic's own members are nobody's concern.
            groups["Settings"].append(f".. autoclass:: sealtwin.{name}")
        elif issubclass(value, Exception):
            groups["Errors"].append(f".. autoexception:: sealtwin.{name}")
        else:
            groups["Results"].append(f".. autoclass:: sealtwin.{name}\n   :members:\n   :no-undoc-members:")
    return "\n\n".join(
        f"## {title}\n\n```{{eval-rst}}\n{chr(10).join(f'{directive}{chr(10)}' for directive in directives)}```"
        for title, directives in groups.items()
        if directives
    )


def tables_of(root: type[Settings], above: str = "") -> Iterator[tuple[str, bool, type[Settings]]]:
    """Dotted name of each table, whether it may be repeated, and its class; tables before those within them."""
    for name, field in root.model_fields.items():
        inner, repeated = _settings_in(field.annotation)
        if inner is not None:
            heading = f"{above}{name}"
            yield heading, repeated, inner
            yield from tables_of(inner, f"{heading}.")


def escaped(text: str) -> str:
    """Text of a docstring in which Markdown sees nothing but code."""
    paragraphs = [re.sub(r"\s*\n\s*", " ", paragraph) for paragraph in re.split(r"\n\s*\n", text.strip())]
    parts = CODE.split("\n\n".join(paragraphs))
    return "".join(part if CODE.fullmatch(part) else SPECIAL.sub(r"\\\1", part) for part in parts)


def _entries(settings: type[Settings]) -> Iterator[str]:
    texts = described(settings)
    for name, field in settings.model_fields.items():
        # A table that may also be a file's name has an entry beside its own heading.
        if _settings_in(field.annotation)[0] is not None and Path not in _branches(field.annotation):
            continue
        kind = LITERAL.sub(r"`\g<0>`", allowed(field))
        default = "required" if field.is_required() else f"default: {_shown(field.default)}"
        yield f"`{name}`"
        # An optional setting without a default has none to show.
        traits = [kind, *([] if field.default is None and not field.is_required() else [default])]
        yield f": *{escaped('; '.join(trait for trait in traits if trait))}*"
        if text := texts.get(name, ""):
            yield f"\n  {escaped(text)}"
        yield ""


def _settings_in(annotation: Any) -> tuple[type[Settings] | None, bool]:
    """The settings class inside X, X | None or tuple[X, ...], and whether there may be several."""
    if isinstance(annotation, type) and issubclass(annotation, Settings):
        return annotation, False
    for inner in get_args(annotation):
        settings, _ = _settings_in(inner)
        if settings is not None:
            return settings, typing.get_origin(annotation) is tuple
    return None, False


def _branches(annotation: Any) -> list[Any]:
    """The types of an annotation, those of a union one by one."""
    return [inner for part in get_args(annotation) for inner in _branches(part)] or [annotation]


def _shown(value: Any) -> str:
    if isinstance(value, Path):
        value = str(value)
    return f"`{json.dumps(value)}`"


def _help(text: str) -> str:
    paragraphs = [re.sub(r"\s*\n\s*", " ", part) for part in inspect.cleandoc(text).split("\n\n")]
    return "\n\n".join(_paragraph(part) for part in paragraphs)


def _paragraph(text: str) -> str:
    """A line that shows a command becomes code."""
    if example := re.fullmatch(r"(?:Examples?: )?(sealtwin .*)", text):
        return f"```sh\n{example[1]}\n```"
    return escaped(text)


def _parameter(parameter: Any, context: Any) -> str:
    shown, text = parameter.get_help_record(context)
    if parameter.param_type_name == "argument":
        shown = parameter.metavar or parameter.name
    # Default and range stand in brackets at the end, after two spaces.
    described, _, limits = text.partition("  [")
    if text.startswith("["):
        described, limits = "", text[1:]
    # A range of whole numbers says as much as its type does.
    shown = shown.replace("<int range>", "N").replace("<float range>", "X").replace("<float>", "X")
    more = f" *({escaped(limits.removesuffix(']'))})*" if limits else ""
    return f"`{shown}`\n: {escaped(described)}{more}\n"
