"""Records in a notebook: one line as text, a small table as HTML, in place of all their arrays."""

from collections.abc import Mapping
from html import escape


class Shown:
    """Base of records with a short description. It is before other bases, and its dataclasses have ``repr=False``."""

    @property
    def main_figures(self) -> Mapping[str, str]:
        """Names and values that tell one record from another, with units."""
        raise NotImplementedError

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name} {value}' for name, value in self.main_figures.items())})"

    def __str__(self) -> str:
        return repr(self)

    def _repr_html_(self) -> str:
        cells = ((escape(name), escape(value)) for name, value in self.main_figures.items())
        rows = "".join(f"<tr><th>{name}</th><td>{value}</td></tr>" for name, value in cells)
        return f"<table><caption>{type(self).__name__}</caption>{rows}</table>"
