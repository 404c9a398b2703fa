"""The directives that put generated text on a page."""

from typing import Any, ClassVar

import reference_text
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class Commands(SphinxDirective):
    """Every command of the command line."""

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(reference_text.commands_text(), allow_section_headings=True)


class SettingsOf(SphinxDirective):
    """Every setting of the kind of file that is named: trial, study or cell."""

    required_arguments: ClassVar[int] = 1

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(reference_text.settings_text(self.arguments[0]), allow_section_headings=True)


class PublicNames(SphinxDirective):
    """Functions and classes of ``import sealtwin``."""

    def run(self) -> list[nodes.Node]:
        text = reference_text.python_text() or "This version exports no public name."
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def without_class_signature(
    app: Sphinx, what: str, name: str, value: object, options: object, signature: str | None, returned: str | None
) -> tuple[str, None] | None:
    """No signature for classes: users do not construct results, and settings list their keywords in the docstring."""
    return ("", None) if what == "class" else None


def setup(app: Sphinx) -> dict[str, Any]:
    app.add_directive("sealtwin-commands", Commands)
    app.add_directive("sealtwin-settings", SettingsOf)
    app.add_directive("sealtwin-names", PublicNames)
    app.connect("autodoc-process-signature", without_class_signature)
    return {"parallel_read_safe": True}
