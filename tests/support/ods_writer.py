"""Write OpenDocument spreadsheets, as LibreOffice saves them, without the code that reads them."""

import zipfile
from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import escape

NAMES = " ".join(
    f'xmlns:{short}="urn:oasis:names:tc:opendocument:xmlns:{short}:1.0"'
    for short in ("office", "table", "text", "style")
)
Cell = str | float | None


def write_ods(path: Path, rows: Sequence[Sequence[Cell]], *, name: str = "Tabelle1", more: str = "") -> Path:
    """A text that begins with ``{across=3}`` is merged with cells to the right; ``more`` are further rows."""
    table = "".join(f"<table:table-row>{''.join(map(_cell, row))}</table:table-row>" for row in rows)
    return write_content(path, f'<table:table table:name="{name}">{table}{more}</table:table>')


def write_content(path: Path, tables: str, *, prolog: str = "", styles: str = "") -> Path:
    content = (
        f'<?xml version="1.0" encoding="UTF-8"?>{prolog}<office:document-content {NAMES}>'
        f"<office:automatic-styles>{styles}</office:automatic-styles>"
        f"<office:body><office:spreadsheet>{tables}</office:spreadsheet></office:body></office:document-content>"
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("content.xml", content, zipfile.ZIP_DEFLATED)
    return path


def _cell(cell: Cell) -> str:
    if cell is None:
        return "<table:table-cell/>"
    if isinstance(cell, str):
        across, _, words = cell.removeprefix("{across=").partition("}") if cell.startswith("{") else ("1", "", cell)
        text = f"<text:p>{escape(words)}</text:p>"
        spans = f' table:number-columns-spanned="{across}"' if across != "1" else ""
        covered = "<table:covered-table-cell/>" * (int(across) - 1)
        return f'<table:table-cell office:value-type="string"{spans}>{text}</table:table-cell>{covered}'
    shown = f"{cell:.2f}".replace(".", ",")
    number = f'office:value-type="float" office:value="{cell!r}"'
    return f"<table:table-cell {number}><text:p>{shown}</text:p></table:table-cell>"
