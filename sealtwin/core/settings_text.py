"""Describe settings and their allowed values for reference pages and help()."""

import ast
import inspect
import json
import re
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from textwrap import fill, indent
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

Table = type[BaseModel]

KINDS: dict[Any, tuple[str, str]] = {
    int: ("whole number", "whole numbers"),
    float: ("number", "numbers"),
    str: ("text", "texts"),
    bool: ("true or false", "true or false"),
    Path: ("filename", "filenames"),
    Any: ("any value", "any values"),
}
"""Name of each type in the singular and the plural."""
BOUNDS = {"gt": "above", "ge": "from", "lt": "below", "le": "up to"}
WIDTH = 100  # Characters in a line of help()
REFUSED = "Raises\n------\nInputError\n    A keyword is unknown, or its value is not allowed."


@cache
def described(kind: type) -> dict[str, str]:
    """Return the docstring of each field of a table or a record, by field name. Fields of base classes are included.

    The docstrings are read from the source code when they are first needed. pydantic's ``use_attribute_docstrings``
    would add 45 ms to each start.
    """
    texts: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        if base not in (BaseModel, object):
            for statement, below in pairwise(_body_of(base)):
                match statement, below:
                    case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                        texts[name] = inspect.cleandoc(text)
    return texts


def _body_of(kind: type) -> list[ast.stmt]:
    """Return the statements of a class at the top level of its module. For speed, only the class is parsed."""
    module = inspect.getsource(sys.modules[kind.__module__])
    source = re.search(rf"^class {kind.__name__}\b.*?(?=^[\w@]|\Z)", module, re.MULTILINE | re.DOTALL)
    match ast.parse(source[0] if source else "").body:
        case [ast.ClassDef(body=body), *_]:
            return body
    return []


def allowed(field: FieldInfo) -> str:
    """Return the allowed values of a field in words: type, choices and bounds."""
    return _in_words(field.annotation, field.metadata)


def _in_words(annotation: Any, constraints: Sequence[Any] = (), *, several: bool = False) -> str:
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _in_words(parts[0], [*constraints, *annotation.__metadata__], several=several)
    if origin in (Union, UnionType):
        words = [_in_words(part, constraints, several=several) for part in parts if part is not NoneType]
        return ", or ".join(dict.fromkeys(words))
    if origin is Literal:
        return " or ".join(map(json.dumps, parts))
    if origin is tuple:
        return _of_tuple(list(parts), several)
    singular, plural = KINDS.get(annotation, ("table", "tables"))
    return " ".join(filter(None, [plural if several else singular, *_bounds(annotation, constraints)]))


def _of_tuple(parts: list[Any], several: bool) -> str:
    lists = "lists" if several else "list"
    if parts[-1] is Ellipsis:
        return f"{lists} of {_in_words(parts[0], several=True)}"
    if any(part != parts[0] for part in parts):
        return f"{lists} of {len(parts)}: {'; '.join(map(_in_words, parts))}"
    words = _in_words(parts[0], several=True)
    if len(parts) > 2:
        return f"{lists} of {len(parts)} {words}"
    if get_origin(parts[0]) is tuple and not several:
        return f"2 {words}"
    return f"{'pairs' if several else 'pair'} of {words}"


def _bounds(kind: Any, constraints: Sequence[Any]) -> Iterator[str]:
    # A Field inside an annotation contains a list of constraints.
    flat = [
        bound
        for constraint in constraints
        for bound in (constraint.metadata if isinstance(constraint, FieldInfo) else [constraint])
    ]
    if kind is str:
        yield from (f"of up to {bound.max_length:,} characters" for bound in flat if getattr(bound, "max_length", None))
    limits = {name: getattr(bound, name) for name in BOUNDS for bound in flat if hasattr(bound, name)}
    shown = {name: f"{int(limit) if float(limit).is_integer() else limit:,}" for name, limit in limits.items()}
    both = shown.keys() == {"ge", "le"}
    yield "from {ge} to {le}".format(**shown) if both else ", ".join(f"{BOUNDS[name]} {shown[name]}" for name in shown)


def meaning(kind: Table) -> str:
    """Return the docstring of a table, without its fields. If it has none, return its base class's docstring."""
    return inspect.cleandoc(next(filter(None, (vars(base).get("__doc__") for base in kind.__mro__)), ""))


def text_of_table(kind: Table) -> str:
    """Return the docstring of a table with a parameter for each of its fields."""
    text = meaning(kind)
    entries = "\n".join(entry_of(kind, name) for name in kind.model_fields)
    return f"{text}\n\nParameters\n----------\n{entries}\n\n{REFUSED}\n"


def entry_of(kind: Table, name: str, default: Any = None) -> str:
    """Return the entry of a setting in a docstring: its name, its allowed values and its meaning."""
    field = kind.model_fields[name]
    default = default if field.is_required() else field.default
    shown = json.dumps(default) if isinstance(default, str) else repr(default)
    traits = allowed(field) + ("" if default in (None, inspect.Parameter.empty) else f"; default: {shown}")
    return f"{name} : {traits}\n{indent(fill(described(kind).get(name, ''), WIDTH), '    ')}"


class OwnNames(BaseModel):
    """Base class of tables and records whose Tab completion shows no names of pydantic."""

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__()} - {*dir(BaseModel)})
