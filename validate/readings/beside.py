"""Texts beside the numbers of a sheet: which are known to leave the readings as they are, and which may change them.

A text is harmless if each of its clauses is: no word that may change readings, a harmless topic (a person, a client, a
photo), and few unknown words and numbers. Any other becomes part of a question. The words are in
``words_beside.toml``.
"""

# ruff: noqa: RUF001  Texts of labs have letters of all scripts.

import re
import tomllib
import unicodedata
from importlib.resources import files
from itertools import accumulate, combinations

from validate.readings.words import sample_key

LETTERS = str.maketrans(
    "łø\u0131æc\u2019абвгґдеєжзиіклмнопрстуфхцчшщыэюяαβγδεζηθικλμνξοπρσςτυφχψω",
    "loiak'abvggdeejziiklmnoprstufhkqwwyeuaavgdezitiklmnxoprsstufhqo",
    "ьъ",
)


def plain(text: str) -> str:
    """Return the text in small letters without accents, and with k for c. Marks of Japanese letters are kept."""
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


def changes(text: str) -> bool:
    """Return True if a text has a word or a sign that may change readings: unit, side, zero, factor, rejection."""
    return not CHANGES.isdisjoint(_kinds(text))


def is_harmless(text: str, sample: str = "") -> bool:
    """Return True only if a text is known to leave the readings of its sample as they are: a date, an operator.

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
    """Return the kinds of words, numbers and signs, without unknown words of up to three letters."""
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
    """Return the kind of the longest entry that fits a plain word, or an empty text."""
    inner = (f"*{word[start:end]}" for start, end in combinations(range(len(word) + 1), 2))
    parts = {f"{word}.", *accumulate(word), *inner}
    return KINDS.get(max(sorted(KINDS.keys() & parts), key=len, default=""), "")
