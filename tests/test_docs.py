"""Generated pages of the documentation list every setting, command and option."""

import importlib.util
import re
from itertools import pairwise
from types import ModuleType

import pytest

from sealtwin.core.settings_text import described
from tests.support.paths import ROOT
from tests.support.processes import commands


@pytest.fixture(scope="module")
def reference() -> ModuleType:
    """A module of the documentation, which is in no package and imports nothing of Sphinx."""
    spec = importlib.util.spec_from_file_location("reference_text", ROOT / "docs" / "_ext" / "reference_text.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _keys(schema: dict, defs: dict, above: str = "") -> set[str]:
    """Dotted names of all settings, by the JSON schema that pydantic makes and not by the page's own walk."""
    keys: set[str] = set()
    for name, content in schema.get("properties", {}).items():
        text = str(content)
        inner = [defs[ref] for ref in re.findall(r"#/\$defs/(\w+)", text)]
        tables = [table for table in inner if table.get("type") == "object"]
        keys |= set().union(*(_keys(table, defs, f"{above}{name}.") for table in tables))
        if not tables or "'format': 'path'" in text:
            keys.add(above + name)
    return keys


def _on_page(text: str) -> set[str]:
    """Dotted names of the settings that a page lists, each with something below it."""
    keys, table = set(), ""
    lines = text.splitlines()
    for line, below in pairwise(lines):
        if heading := re.fullmatch(r"## `\[+([\w.]+)\]+`", line):
            table = f"{heading[1]}."
        elif (entry := re.fullmatch(r"`(\w+)`", line)) and below.startswith(": *"):
            keys.add(table + entry[1])
    return keys


@pytest.mark.parametrize("kind", ["trial", "study", "cell"])
def test_every_setting_of_a_file_is_listed_in_its_reference_page(reference, kind):
    schema = reference.FILES[kind].model_json_schema()
    wanted = _keys(schema, schema.get("$defs", {}))
    assert len(wanted) > 5
    assert _on_page(reference.settings_text(kind)) == wanted


def test_every_setting_has_a_description(reference):
    for root in reference.FILES.values():
        for table in (root, *(table for _, _, table in reference.tables_of(root))):
            below = {heading for heading, _, _ in reference.tables_of(table)}
            assert not set(table.model_fields) - set(described(table)) - below, table


def test_every_command_and_option_is_listed_in_the_reference(reference):
    text = reference.commands_text()
    for name, command in commands().items():
        section = text[text.index(f"## sealtwin {name}\n") :].split("\n## ")[0]
        options = [name for one in command.params if one.param_type_name == "option" for name in one.opts]
        assert [option for option in options if not re.search(rf"[`\s]{option}[`,\s]", section)] == [], name


def test_documentation_pages_load_nothing_from_the_network():
    """Built pages are read on machines without a network."""
    docs = ROOT / "docs"
    sources = [*docs.glob("*.py"), *(docs / "_ext").glob("*.py"), *(docs / "_static").iterdir()]
    assert len(sources) >= 4
    assert not [path.name for path in sources if "http" in path.read_text(encoding="utf-8")]
