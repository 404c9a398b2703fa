"""Texts next to the numbers of a sheet: they are either harmless, or quoted in one question.

A text is harmless if each of its clauses is harmless: it has no word that may change readings, it has a harmless topic
(a person, a client, a photo), and it has few unknown words and numbers. The words are in ``words_beside.toml``. Marks
of cells, such as a strike, and names of columns that may change readings also lead to questions.
"""

# ruff: noqa: RUF001  Texts of labs have letters of all scripts.

import re
import tomllib
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterator
from importlib.resources import files
from itertools import accumulate, combinations
from typing import NamedTuple

from sealtwin.core.doubts import CONFIRMS
from validate.readings.grid import Grid, letters, listed, quoted, shown
from validate.readings.rows import ReadRows
from validate.readings.table import Table, numeric, roles_in
from validate.readings.words import NUMBER, Role, is_missing, is_note, meaning, parsed, sample_key

LETTERS = str.maketrans(
    "łø\u0131æc\u2019абвгґдеєжзиіклмнопрстуфхцчшщыэюяαβγδεζηθικλμνξοπρσςτυφχψω",
    "loiak'abvggdeejziiklmnoprstufhkqwwyeuaavgdezitiklmnxoprsstufhqo",
    "ьъ",
)


def plain(text: str) -> str:
    """Return the text in lower case without accents, with k instead of c. Marks of Japanese letters are kept."""
    text = unicodedata.normalize("NFKD", text.casefold()).translate(LETTERS)
    bare = (letter for letter in text if letter > "\u3000" or unicodedata.category(letter) != "Mn")
    return unicodedata.normalize("NFC", "".join(bare))


LISTS = tomllib.loads(files("validate").joinpath("readings", "words_beside.toml").read_text("utf-8"))
BESIDE, BEHIND, WORTH, WORTH_BESIDE = map(LISTS.pop, ("beside", "behind", "worth", "worth_beside"))
KINDS = {plain(entry): kind for kinds in LISTS.values() for kind, entries in kinds.items() for entry in entries.split()}
CHANGES = LISTS["changes"].keys()
ASKED = CHANGES | LISTS["subjects"].keys()
HAN = "\u3040-\u30ff\u3400-\u9fff"  # Scripts without blanks
HAN_ENTRIES = "|".join(entry for entry in sorted(KINDS, reverse=True) if entry > "\u3040")
FIGURES = re.compile(
    # Dates, times, addresses of mail, telephones, places of a road, temperatures, lengths of calipers; "i.O.", "b.z.".
    r"(?i)(?<![\d.,/a-z-])(?:\d{4}([-/. ]{1,2})\d\d?\1\d\d?|\d\d?([-/.]) ?\d\d?\2 ?(?:20)?\d\d|\d\d?[/.]20\d\d"
    r"|20\d\d[/.-]\d\d?|\d\d?\. ?\d\d?\.(?!\d)|(?!1/)\d\d?/\d\d?(?:-\d\d)?"
    r"|\d\d?\.? (?:d[eo]l? )?[^\W\d_]{3,11}\.? (?:d[eo]l? )?20\d\d)(?![\w/-])"
    r"|\b(?:le|on|am|den|dne|dnia|il|el|от|від|до|due|bis|do|til|kal\w*\.?) \d\d?[./-](?:0[1-9]|1[0-2]|2\d)"
    r"\.?(?![\d/-]|\.\d)|(?:\d{4}年)?\d\d?月(?:\d\d?日)?|(?<![\w.-])[\w.-]{1,40}@[\w.-]+|\+?\d{2,4}(?:[ /-]\d{2,4}){3,}"
    r"|(?<![\w.,:])(?!1:)(?:[01]?\d|2[0-3])(?::[0-5]\d(?::[0-5]\d)?|[h時点](?:[0-5]\d分?)?)(?![\w:])"
    r"|\b(?:klo?|ore)\.? ?\d\d?\.\d\d|-?\d{1,3}(?:[.,]\d)? ?(?:° ?c\b|degc)|\b0 ?[-\u2013] ?[1-9]\d0 ?mm"
    r"|\b[a-z]?\d{1,4} ?\+ ?\d{3}(?:[.,]\d+)?(?: ?(?:[-\u2013~/]|to|til|al?|εως) ?[\d.,+]+)?"
    r"|(?<![\w.])(?:i\.o|b\.z|s\.k|o\.b|b\.u|u\.a)\.|(?<=\w)['\u2019]s\b|\bs pozdr\w+|\d[\d.,]*k[mp]\b"
)
NUMBER_SIGN = re.compile(
    r"(?i)(?<![a-z])(?:(?:n[or]\.?\s*|s/n\.?\s*|s\.?nr\.?|s\.\s*|ст\.|стр\.|sz\.|αρ\.|с\.)(?=\s?[a-z]{0,3}[-/]?\d)"
    r"|n\.?[°º]|№|#|v\.č\.|č\.(?= ?\d))|(?<=\d )(?:nolu|numaral\w+)"
    # Under "Remarks", "no" and "not" mean none only if they are alone.
    r"|^(?:remark|note|bem|anm|obs|uwag|pozn)\w*: (?!\w{1,7}$)|(?<=\d) (?:of|v[oa]n|d[ei]|z|из) \d+"
)
TOKEN = re.compile(
    r"(?P<part>[,、](?!\d))|(?P<day>(?<![\w.,])[0-3]\d\.(?:0[1-9]|1[0-2])(?![\w.]))|(?P<measure>(?<!\w)[-+\u2212]\d[\d.,]*"
    r"|(?<!\d)\d+(?:,\d+| ?[%°])|\d/10+\b|\b1/\d+|(?<!\d)\d{1,3}\.\d{1,2}(?:-\d\d?\.\d\d)?(?![\w.]))"
    # Units behind numbers or in brackets; marks of inches; signs.
    r"|(?P<sign>(?:\d ?|(?<![a-zA-Zа-я]))[cсmм][mм](?![a-zа-я])|\d ?x(?![a-z])"
    r"|\bx\d|\d\W?(?:m|in)(?!\w|\s+[^\W\d])|[\[(](?:m|in)[\])]|(?<!\w)in\W*$|\d\s?['\"](?![td][ae])"
    r"|\+(?! [^\W\d])|[\u00b1\u00d7*%\u00b0?<>~\u2248\u2033\u2032\u2190-\u21ff\u221a\u2044^|])|(?P<equals>=)"
    r"|(?P<code>\b(?!SN|R[HF]|UR)[A-Z]{2,3}[- ]?\d+(?:[-/]\d+)*(?!\w)"
    r"|\b[^\W\d_]{0,4}[-_]?(?:\d{4,}|\d{2,}[-/]\d{3,})[\w/-]*)"
    rf"|(?P<another>\b[A-Z]{{1,3}}0\d\b)|(?P<number>[^\W\d_{HAN}]{{0,4}}[-_]?\d[\da-zA-Z]*"
    r"(?:(?:[-./+,_:]| [yueiи&] | u\. | et | og | och | and | und | to | bis | til | t/m )[\da-zA-Z]+)*)"
    rf"|(?P<word>{HAN_ENTRIES}|[§¤]|(?!(?:[A-ZÀ-ÞŚŞŠŻŽČА-Я]|с|(?<=\.)s)(?!\w))[^\W\d_{HAN}]{{1,30}})|(?P<letter>[{HAN}])"
)
CLAUSE = re.compile(r"[;\n。]| [-\u2013\u2014] (?!\d)|(?<=\w{6})\.\s+(?=\w{3})")
GERMAN = re.compile(r"\b(?:und|mit|vom|der|das|ist|wurden?|am|im|ab|auf|beim?|nach|zu[rm]?)\b|emes")
MAX_QUOTED, LONGEST_QUOTED = 60, 400  # Largest number of quoted texts of a sheet, and of characters in each
REMEDY = "If it does, write what it says into other answers (unit, direction, datum, end of s, skip); then confirm it."
NAMES, RANGE = "names", "range"
"""Entries of as_written: for the names of file and worksheet, and for all texts outside the range."""
MARKS: dict[str, tuple[str, Callable[[Grid, int, int], bool | str]]] = {
    "struck": ("struck through", lambda grid, row, column: grid.cell(row, column).is_struck),
    "hidden": ("hidden", lambda grid, row, column: row in grid.hidden_rows or column in grid.hidden_columns),
    "coloured": ("coloured unlike the others", lambda grid, row, column: grid.cell(row, column).colours),
}
"""Marks of cells by kind: the mark in words, and a function that returns the mark of a cell."""
CODE = re.compile(r"[^\W\d_]{1,3}[ _-]?[0-9]+\w?")
LABEL = re.compile(r"(?:[^\W\d]*[\W_]*)?[0-9]+|\w")  # Number of a repeat, possibly after a word, or a letter


class Text(NamedTuple):
    """A text next to the readings."""

    answer: str  # Entry of as_written that confirms the text
    text: str
    where: str
    beside: str = ""  # Position and readings in the row of the text


def ask_about_rest(table: Table, rows: ReadRows) -> None:
    """Ask once about the texts that may change the readings, and once about each kind of mark on cells that are read.

    The name of the sample is harmless.
    """
    _ask_about_names(table)
    sample = table.declared.sample or table.grid.path.stem
    texts = [text for text in _texts(table, rows, sample) if not is_harmless(text.text, sample)]
    texts += _names(table.grid, table.declared.sample)
    texts = [text for text in texts if not table.confirms(text.answer)]
    if texts:
        alike = dict[str, list[str]]()
        for text in sorted(texts, key=lambda text: not changes(text.text)):
            quote = f"{text.where} {quoted(text.text, LONGEST_QUOTED)}{text.beside}"
            alike.setdefault(text.text, []).append(quote)
        # Each text is shown, those with a word that may change readings first; of equal ones the first.
        confirms = sorted({text.answer for text in texts})
        finding = f"does this change the readings? {listed([*map(listed, alike.values())], MAX_QUOTED)}."
        stops = any(changes(text.text) for text in texts if text.answer != NAMES)
        table.ask("remark", finding, REMEDY, {CONFIRMS: confirms}, confirms, stops=stops)
    _ask_about_marks(table, rows)


def _texts(table: Table, rows: ReadRows, sample: str) -> Iterator[Text]:
    """Yield the texts outside the header and the readings of a sheet, comments, and other texts in the file."""
    grid, (columns_inside, rows_inside) = table.grid, table.span

    def text_of(row: int, column: int, text: str, beside: str = "", what: str = "") -> Text:
        is_inside = column in columns_inside and (row in rows_inside or row in table.header.rows)
        cell = f"{letters(column)}{row}"
        return Text(cell if is_inside or not table.confirms(RANGE) else RANGE, text, what + cell, beside)

    numbers = {column for row in table.body for column, cell in grid.rows[row].items() if numeric(cell)}
    samples = {k for k, column in table.others.items() if column.role is Role.SAMPLE}
    labels = {column for column in table.header.names if _has_labels(table, rows, column)}
    for row, cells in grid.rows.items():
        filled = [(column, cell) for column, cell in cells.items() if cell.text]
        if row in rows.read or row in table.header.rows:
            texts = [table.cell(row, column).text for column in table.used if column is not table.repeat]
            beside = f" beside {' '.join(map(shown, texts))}" if row in rows.read else ""
            for column, cell in filled:
                if column not in labels and _may_change(table, row, column, numbers, sample):
                    yield text_of(row, column, cell.text, beside)
        elif row not in rows.passed and not {Role.STATION, Role.READING} <= roles_in(cells.values()):
            # The name of a sample beside numbers is that of another one.
            words = {column for column, cell in filled if not numeric(cell)}
            words -= samples if len(words) < len(filled) else set()
            if words or (filled and rows_inside.start <= row < table.header.first):
                yield text_of(row, filled[0][0], " ".join(cell.text for _, cell in filled))
    for row, column, text in grid.comments:
        yield text_of(row, column, text, what="comment in ")
    for where, text in grid.elsewhere:
        yield Text("worksheets", text, where)


def _has_labels(table: Table, rows: ReadRows, column: int) -> bool:
    """Return whether the texts of a column name the stations, for example P1, P2, P3."""
    labels = {table.grid.cell(row, column).text for row in rows.read} - {""}
    return len(labels) == len(rows.cells.s_mm) and all(map(CODE.fullmatch, labels))


def _may_change(table: Table, row: int, column: int, numbers: set[int], sample: str) -> bool:
    """Return whether a text may change readings: in the header or next to readings, and not known to be harmless."""
    cell, name = table.grid.cell(row, column), table.header.names.get(column, "")
    roles, other = {each.role for each in table.used if each.index == column}, table.others.get(column)
    if row in table.header.rows:
        # A column of numbers under an unknown name is asked about, but not a title above it.
        is_title = row < table.header.rows[-1] and table.is_open("columns", "range")
        return is_title or not (roles or other or column in numbers)
    if roles:
        # The number of a repeat is no reading, and no word.
        return Role.REPEAT in roles and LABEL.fullmatch(cell.text) is None
    if is_missing(cell.text) or (numeric(cell) and not is_note(name)):
        return False
    if other is not None and other.role.is_quantity and (value := NUMBER.match(cell.text)):
        # A value of the quantity, or in doubt, unless more than a unit stands behind it.
        return len(cell.text[value.end() :].split()) > 1
    return other is None or not is_harmless(f"{name}: {cell.text}", sample)


def _names(grid: Grid, sample: str | None) -> Iterator[Text]:
    """Yield the names of the worksheet and of the file, without the name of the sample."""
    stem = grid.path.stem.replace(sample, " ") if sample else grid.path.stem
    for what, name in (("name of the worksheet", grid.sheet or ""), ("name of the file", stem)):
        # "P02" in the file of P01 is another sample.
        is_other = sample and CODE.fullmatch(name) and sample_key(name) != sample_key(sample)
        if is_other or (len(name.strip()) > 1 and changes(name)):
            yield Text(NAMES, name, what)


def _ask_about_names(table: Table) -> None:
    """Ask about words and marks in column names that may change what is read, whatever is declared."""
    for column in dict.fromkeys([*(column.index for column in table.used), *table.unclear]):
        text = table.header.names.get(column, "")
        if parsed(text).has_rest or (meaning(text) is None and changes(parsed(text).text)):
            remedy = "Write lengths into the sheet, and what the name says (unit, datum, end of s) into other answers."
            finding = f"does {quoted(text)} change the readings, or is it not a length?"
            row, answer = max(table.header.rows, default=1), [letters(column)]
            table.ask("name", finding, remedy, {CONFIRMS: answer}, answer, row, stops=True)


def _ask_about_marks(table: Table, rows: ReadRows) -> None:
    """Ask about readings that are struck through, hidden, or coloured unlike most of their column."""
    for kind, (words, mark_of) in MARKS.items():
        answers = list[str]()
        for column in table.used:
            marks = {f"{column.letters}{row}": mark_of(table.grid, row, column.index) for row in sorted(rows.read)}
            marks = {cell: mark for cell, mark in marks.items() if cell not in table.chosen.skip}
            usual = Counter(marks.values()).most_common(1)[0][0] if kind == "coloured" and marks else False
            unlike = [cell for cell, mark in marks.items() if mark != usual]
            answers += [column.letters] if kind == "hidden" and len(unlike) == len(rows.read) > 0 else unlike
        if answers:
            finding = f"{words}, but read: {listed(answers)}."
            table.ask(kind, finding, "Skip rows or cells that do not count.", {CONFIRMS: answers}, answers)


def changes(text: str) -> bool:
    """Return True if a text has a word or sign that may change readings: a unit, side, zero, factor or rejection."""
    return not CHANGES.isdisjoint(_kinds(text))


def is_harmless(text: str, sample: str = "") -> bool:
    """Return True only if a text is known to leave the readings of its sample unchanged, such as a date or an operator.

    Texts without a harmless topic, and numbers without a harmless label, give False.
    """
    if sample_key(text) == sample_key(sample):
        return True
    if len(text) > 400:  # Letters; longer ones are quoted in any case
        return False
    if sample:
        text = re.sub(rf"(?i)(?<!\w){re.escape(sample)}(?![\w'*+?])", " ¤ ", text)
    for clause in CLAUSE.split(text):
        kinds, scores = _kinds(clause), [0]
        for i, kind in enumerate(kinds[2:]):
            # Two words on either side can make a word harmless.
            beside = {*BESIDE.get(kind, "").split()} & {*kinds[i : i + 5]}
            if kind in ASKED and not beside:
                return False
            if kind == "part":
                scores.append(0)
            scores[-1] += (WORTH_BESIDE if beside else WORTH).get(kind, 0)
        # Between commas, two unknown words may stand alone, not three.
        if re.search(r"\w", clause) and (min(scores) < -5 or sum(scores) <= 0):
            return False
    return True


def _kinds(text: str) -> list[str]:
    """Return the kinds of words, numbers and signs in a text. Unknown words of up to three letters are left out."""
    text = FIGURES.sub(" § ", unicodedata.normalize("NFKC", NUMBER_SIGN.sub(" ¤ ", text)))
    has_names = not (text.isupper() or GERMAN.search(text))
    kinds = ["", ""]
    for token in TOKEN.finditer(text):
        word, kind = token[0], str(token.lastgroup)
        if kind == "word":
            unknown = "name" if has_names and word[0].isupper() else "unknown" if len(plain(word).encode()) > 3 else ""
            kind = _kind(plain(word)) or (unknown if token.start() else "")
        kind = BEHIND.get(kinds[-1], {}).get(kind, kind)
        if kind:
            kinds.append(kind)
    return kinds


def _kind(word: str) -> str:
    """Return the kind of the longest entry that matches a plain word. Returns an empty text if none matches."""
    inner = (f"*{word[start:end]}" for start, end in combinations(range(len(word) + 1), 2))
    parts = {f"{word}.", *accumulate(word), *inner}
    return KINDS.get(max(sorted(KINDS.keys() & parts), key=len, default=""), "")
