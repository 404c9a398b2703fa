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
from sealtwin.core.settings import Settings, described
from sealtwin.study.study_file import Study
from sealtwin.trial.trial_file import Trial

FILES: dict[str, type[Settings]] = {"trial": Trial, "study": Study, "cell": RobotCell}
"""Kinds of TOML file that a user writes."""
SPECIAL = re.compile(r"([\\*_\[\]<>$#])")
CODE = re.compile(r"(`+[^`]+`+)")
KINDS = {
    "integer": ("whole number", "whole numbers"),
    "number": ("number", "numbers"),
    "string": ("text", "texts"),
    "boolean": ("`true` or `false`", "`true` or `false`"),
    "path": ("path of a file", "paths of files"),
    "object": ("table", "tables"),
}
"""Names of JSON schema's types and formats, for one and for several."""
BOUNDS = {"exclusiveMinimum": "above", "minimum": "from", "exclusiveMaximum": "below", "maximum": "up to"}


def commands_text() -> str:
    """Every command with its arguments and options."""
    from typer.main import get_command

    group: Any = get_command(app)
    parts = []
    for name, command in group.commands.items():
        context = command.make_context(f"sealtwin {name}", [], resilient_parsing=True)
        usage = " ".join(["sealtwin", name, *command.collect_usage_pieces(context)])
        parts.append(
            f"{{#command-{name}}}\n## sealtwin {name}\n\n```text\n{usage}\n```\n\n{_help(command.help or '')}\n"
        )
        parts.extend(_parameter(parameter, context) for parameter in command.params)
    return "\n".join(parts)


def settings_text(kind: str) -> str:
    """The settings of one kind of file, a section for each table."""
    root = FILES[kind]
    parts = ["## At the top of the file", "", *_entries(root)]
    for heading, repeated, settings in tables_of(root):
        brackets = f"[[{heading}]]" if repeated else f"[{heading}]"
        slug = heading.replace(".", "-").replace("_", "-")
        parts += [f"{{#setting-{kind}-{slug}}}", f"## `{brackets}`", "", escaped(_docstring(settings)), ""]
        parts += _entries(settings)
    return "\n".join(parts)


def python_text() -> str:
    """The public names of ``sealtwin`` as Markdown around autodoc's directives, grouped by what they are."""
    groups: dict[str, list[str]] = {"Functions": [], "Settings": [], "Results": [], "Errors": []}
    for name in getattr(sealtwin, "__all__", ()):
        found = getattr(sealtwin, name)
        if not inspect.isclass(found):
            groups["Functions"].append(f".. autofunction:: sealtwin.{name}")
        elif issubclass(found, Settings):
            # Its docstring lists the keywords; pydantic's own members are nobody's concern.
            groups["Settings"].append(f".. autoclass:: sealtwin.{name}")
        elif issubclass(found, Exception):
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
    schema = settings.model_json_schema()
    for name, field in settings.model_fields.items():
        # A table that may also be a file's name has an entry beside its own heading.
        if _settings_in(field.annotation)[0] is not None and Path not in _branches(field.annotation):
            continue
        kind = _in_words(schema["properties"][name], schema.get("$defs", {}))
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
        found, _ = _settings_in(inner)
        if found is not None:
            return found, typing.get_origin(annotation) is tuple
    return None, False


def _branches(annotation: Any) -> list[Any]:
    """The types of an annotation, those of a union one by one."""
    return [inner for part in get_args(annotation) for inner in _branches(part)] or [annotation]


def _in_words(schema: dict[str, Any], defs: dict[str, Any], *, several: bool = False) -> str:
    """What a JSON schema allows, as a person would say it; in the plural where there are several."""
    if "$ref" in schema:
        return _in_words(defs[schema["$ref"].rpartition("/")[2]], defs, several=several)
    for union in ("anyOf", "oneOf"):
        if union in schema:
            parts = [_in_words(part, defs, several=several) for part in schema[union] if part.get("type") != "null"]
            return ", or ".join(dict.fromkeys(parts))
    if "enum" in schema:
        return " or ".join(f"`{json.dumps(value)}`" for value in schema["enum"])
    if "const" in schema:
        return f"`{json.dumps(schema['const'])}`"
    if schema.get("type") == "array":
        return _array(schema, defs, several)
    singular, plural = KINDS.get(schema.get("format", schema.get("type", "")), ("any value", "any values"))
    return " ".join(filter(None, [plural if several else singular, *_bounds(schema)]))


def _array(schema: dict[str, Any], defs: dict[str, Any], several: bool) -> str:
    items = schema.get("prefixItems")
    if items is None:
        return f"{'lists' if several else 'list'} of {_in_words(schema.get('items', {}), defs, several=True)}"
    listed = "lists" if several else "list"
    if len(items) == 2 and items[0] == items[1] and not several and "prefixItems" in items[0]:
        return f"2 {_in_words(items[0], defs, several=True)}"
    if len(items) == 2 and items[0] == items[1]:
        return f"{'pairs' if several else 'pair'} of {_in_words(items[0], defs, several=True)}"
    if all(item == items[0] for item in items):
        return f"{listed} of {len(items)} {_in_words(items[0], defs, several=True)}"
    return f"{listed} of {len(items)}: {'; '.join(_in_words(item, defs) for item in items)}"


def _bounds(schema: dict[str, Any]) -> Iterator[str]:
    if schema.get("type") == "string" and "maxLength" in schema:
        yield f"of up to {schema['maxLength']:,} letters"
    limits = {
        word: int(schema[key]) if float(schema[key]).is_integer() else schema[key]
        for key, word in BOUNDS.items()
        if key in schema
    }
    if "from" in limits and "up to" in limits:
        yield f"from {limits['from']:,} to {limits['up to']:,}"
    else:
        yield ", ".join(f"{word} {limit:,}" for word, limit in limits.items())


def _shown(value: Any) -> str:
    if isinstance(value, Path):
        value = str(value)
    return f"`{json.dumps(value)}`"


def _docstring(settings: type[Settings]) -> str:
    return inspect.cleandoc(settings.__doc__ or "")


def _help(text: str) -> str:
    paragraphs = [re.sub(r"\s*\n\s*", " ", part) for part in inspect.cleandoc(text).split("\n\n")]
    return "\n\n".join(_paragraph(part) for part in paragraphs)


def _paragraph(text: str) -> str:
    """A line that shows a command becomes code."""
    if found := re.fullmatch(r"(?:Examples?: )?(sealtwin .*)", text):
        return f"```sh\n{found[1]}\n```"
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
