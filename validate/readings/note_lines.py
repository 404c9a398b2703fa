"""Notes of a phone: a place and its readings in each line."""

import re

from validate.readings.sheet import SheetCell, SheetRow
from validate.readings.text_table import MINUS, NOTE_HEAD, NUMBER, WORDS, is_missing, plain_letters, several

SIGNS = ("-", "+", "\u2212", "\u2013")
ONLY_NUMBERS = re.compile(r"[0-9.,+\-\u2212\s]+")
MESSAGE = re.compile(
    r"\u200e?\[?\d{1,2}[./]\d{1,2}[./]\d{2,4},?\s+\d{1,2}:\d{2}(?::\d{2})?(?:\s?[AaPp]\.?[Mm]\.?)?\]?(?:\s+-)?"
    r"\s+[^:]{1,60}:\s+"
)
"""Date, time and sender before a line that was copied from a messenger."""
NOTE_LINE = re.compile(
    rf"(?:[-*\u2022]\s+)?(?:\*\*)?(?:[sx]\s*=\s*)?(?P<place>{NUMBER.pattern})\s?(?P<unit>[^\W\d_]{{1,12}}|\")?\s*"
    r"(?:\*\*)?\s*(?:=|->|\u2192|\||:(?!\d\d(?![\d.,]))"
    r"|(?P<between>(?<=\s)(?:[\u2014\u00b7]|(?P<dash>[-\u2013]))(?=\s)|(?(unit)(?<=\s)(?=[-+\u2212\u2013]?[\d.,])|(?!))))"
    r"(?:\*\*)?\s*(?P<readings>.*)"
)
"""Line of a note: a place, a colon, a dash or blanks behind its unit, and its readings. 14:30 is a time."""
DASH = re.compile(r"\s+[-\u2013]\s+")
LENGTHS = frozenset(" ".join(WORDS["units"].values()).split()) | {"in", '"'}
DATE_WORD = re.compile(r"(?<![\d.,])\d{1,4}([./-])\d{1,2}\1(?:\d{2,4})?(?![\d,])")
DECIMAL = re.compile(r"\d[.,]\d|(?<!\w)[.,]\d")
WORD_OF_TITLE = re.compile(r"[^\W\d_]{3}")


def note_rows(text: str) -> tuple[tuple[SheetRow, ...], dict[int, str]]:
    """Return the rows of a note with a place and its readings in each line; none for another text.

    Also returns the readings of rows in which a dash behind the place may be a minus, as they then are.

    Lines above the first place are titles. A line with numbers that does not fit is a row too, so that it is a fault.
    """
    lines = [
        (number, line)
        for number, each in enumerate(text.splitlines(), start=1)
        if (line := MESSAGE.sub("", each.strip(), count=1).strip())
    ]
    matches = {number: _match(line) for number, line in lines}
    fitting = {number for number, match in matches.items() if match is not None and _are_readings(_readings_of(match))}
    near = [match for match in matches.values() if match is not None and any(map(str.isdecimal, match["readings"]))]
    if len(fitting) < 2 or 2 * len(near) <= sum(number >= min(fitting) for number, _ in lines):
        return (), {}
    rows, begins = list[SheetRow](), min(fitting)
    for number, line in lines:
        match, (label, _, rest) = matches[number], line.partition(":")
        is_title = number < begins
        if match is not None and (not is_title or WORD_OF_TITLE.search(match["readings"]) is None):
            cells = " ".join(filter(None, (match["place"], match["unit"]))), _readings_of(match)
        elif _are_readings(rest) and (not is_title or not label.strip() or any(map(str.isdecimal, label))):
            cells = label.strip(), rest.strip()
        elif _may_be_readings(line, is_title=is_title):
            cells = "", line  # A fault, since its place is missing
        else:
            cells = (line,)
        rows.append(SheetRow(number, tuple(map(SheetCell, cells))))
    first = next(at for at, row in enumerate(rows) if len(row.cells) > 1)
    dashed = [(number, match) for number, match in matches.items() if number >= begins and match and match["dash"]]
    # Behind a dash, another minus or a word shows that the dash is none.
    is_minus = not any(match["readings"][:1] in SIGNS or match["readings"][:1].isalpha() for _, match in dashed)
    minus = {number: _with_minus(f" - {match['readings']}") for number, match in dashed if is_minus}
    return (*rows[:first], SheetRow(rows[first].number, NOTE_HEAD), *rows[first:]), minus


def _with_minus(text: str) -> str:
    """Return readings whose dashes are minus signs; before a word for a missing reading they are none."""
    return DASH.sub(" ", re.sub(DASH.pattern + r"(?=[\d.,])", " -", text)).strip()


def _match(line: str) -> re.Match[str] | None:
    """Return the parts of a line of a note. A dash, a dot or blanks separate only a place without another unit."""
    match = NOTE_LINE.fullmatch(line)
    if match is None or match["between"] is None or match["unit"] is None:
        return match
    return match if plain_letters(match["unit"]) in LENGTHS else None


def _readings_of(match: re.Match[str]) -> str:
    text = match["readings"].strip()
    return text if match["dash"] is None else DASH.sub("; ", text)


def _may_be_readings(line: str, *, is_title: bool) -> bool:
    """Return whether a line that does not fit may be one of readings.

    A title with words may state one decimal number.
    """
    words = DATE_WORD.sub(" ", line).lstrip("-*\u2022 ").split()
    numbers = [word for word in words if NUMBER.fullmatch(word.strip(":,;/").translate(MINUS))]
    decimals = len(DECIMAL.findall(" ".join(words)))
    if is_title:
        return decimals > (WORD_OF_TITLE.search(line) is not None) or (len(numbers) > 1 and words[0] == numbers[0])
    return decimals > 0 or len(numbers) > 1 or len(numbers) == len(words) > 0


def _are_readings(text: str) -> bool:
    """Return whether a text is one or several readings, which may have a unit behind them."""
    bare = re.sub(r"\s*[^\W\d_]+$", "", text.strip()) or text.strip()
    is_one = NUMBER.fullmatch(bare.translate(MINUS)) is not None or (bool(bare) and is_missing(bare))
    return is_one or bool(several(bare)) or ("," in bare and ONLY_NUMBERS.fullmatch(bare) is not None)
