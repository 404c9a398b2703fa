"""What all sheets of an XLSX share: where they lie, texts, and which styles show a number as a date."""

import re
from pathlib import PurePosixPath

from validate.sheets.workbook_archive import Handler, UnusableError

BUILT_IN_DATES = {*range(14, 23), *range(27, 37), *range(45, 48), *range(50, 59)}
"""ECMA-376 part 1, 18.8.30, with the East Asian ones."""
NO_DATE = re.compile(r'"[^"]*"|\\.|_.|\*.|\[(?![hms]+\])[^\]]*\]|General|Standard', re.IGNORECASE)
"""What of a number's format is text, padding, colour or condition."""
LONGEST_FORMAT = 255
"""Letters, as Excel has it."""


class Relations(Handler):
    """Where the sheets lie, by their ids, and what all of them share."""

    def __init__(self) -> None:
        self.sheets: dict[str, str] = {}
        self.strings: str | None = None
        self.styles: str | None = None

    def start(self, name: str, values: dict[str, str]) -> None:
        if name != "Relationship" or values.get("TargetMode") == "External":
            return
        target = values.get("Target", "")
        part = target.lstrip("/") if target.startswith("/") else str(PurePosixPath("xl") / target)
        kind = values.get("Type", "").rpartition("/")[2]
        if kind == "worksheet":
            self.sheets[values.get("Id", "")] = part
        elif kind == "sharedStrings":
            self.strings = part
        elif kind == "styles":
            self.styles = part


class Book(Handler):
    """Name, id and whether it is hidden, of each sheet; and the day that counts as the first."""

    def __init__(self) -> None:
        self.sheets: list[tuple[str, str, bool]] = []
        self.from_1904 = False

    def start(self, name: str, values: dict[str, str]) -> None:
        if name == "sheet":
            key = next((value for key, value in values.items() if key.rpartition(":")[2] == "id"), "")
            self.sheets.append((values.get("name", ""), key, values.get("state", "visible") != "visible"))
        elif name == "workbookPr":
            self.from_1904 = values.get("date1904") in ("1", "true")


class Strings(Handler):
    """Texts that cells share, without what is only said of their pronunciation."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._pieces: list[str] = []
        self._inside, self._spoken = False, False

    def start(self, name: str, values: dict[str, str]) -> None:
        if name == "si":
            self._pieces = []
        self._spoken = self._spoken or name == "rPh"
        self._inside = name == "t" and not self._spoken

    def end(self, name: str) -> None:
        self._inside = False
        if name == "rPh":
            self._spoken = False
        elif name == "si":
            self.texts.append("".join(self._pieces).strip())

    def text(self, piece: str) -> None:
        if self._inside:
            self._pieces.append(piece)


class Styles(Handler):
    """Which of the cells' styles show a number as a date."""

    def __init__(self) -> None:
        self.dates: list[bool] = []
        self._formats = {str(key): True for key in BUILT_IN_DATES}
        """Whether a format is a date's, by its key."""
        self._of_cells = False

    def start(self, name: str, values: dict[str, str]) -> None:
        if name == "numFmt":
            self._formats[values.get("numFmtId", "")] = _is_of_a_date(values.get("formatCode", ""))
        elif name == "cellXfs":
            self._of_cells = True
        elif name == "xf" and self._of_cells:
            self.dates.append(self._formats.get(values.get("numFmtId", "0"), False))

    def end(self, name: str) -> None:
        if name == "cellXfs":
            self._of_cells = False


def _is_of_a_date(code: str) -> bool:
    if len(code) > LONGEST_FORMAT:
        raise UnusableError(f"a format of {len(code):,} letters; {LONGEST_FORMAT} are allowed")
    return any(letter in "dmyhs" for letter in NO_DATE.sub("", code).lower())
