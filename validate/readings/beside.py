"""Texts beside the numbers of a sheet: which are known to leave the readings as they are, and which may change them.

A text is harmless only if all its words are known to be harmless; any other becomes part of a question. The words are
in ``words_beside.toml``.
"""

import re
import tomllib
import unicodedata
from importlib.resources import files as resources

from validate.readings.names import sample_key

LETTERS = str.maketrans(
    {"ł": "l", "Ł": "L", "ø": "o", "\u0131": "i", "ß": "ss", "\u2019": "'", "º": "°", "§": "?", "æ": "a"}
)
MARKS = ".,;:-\u2013\u2014/()\"'&#_!@。、§"
LONGEST = 400  # Letters; a longer text is quoted in any case, and the time of expressions grows with its square
MOST_NAMES = 4  # Words of a name behind its label
MOST_UNLABELLED = 3  # Words of names that have no label


def plain(text: str) -> str:
    """Return the text without accents. Umlauts are one vowel, however they are spelt; case is kept."""
    text = unicodedata.normalize("NFD", unicodedata.normalize("NFKC", text.translate(LETTERS)))
    bare = "".join(letter for letter in text if unicodedata.category(letter) != "Mn")
    return re.sub("([aou])e", r"\1", bare, flags=re.IGNORECASE)


LISTS = tomllib.loads(plain(resources("validate").joinpath("readings", "words_beside.toml").read_text("utf-8")))
HAN = "[\u3040-\u30ff\u3400-\u9fff]"  # Scripts without blanks
LETTER = rf"(?:(?!{HAN})[^\W\d_])"


def _words(words: str, stems: str = "", compounds: str = "") -> str:
    """Return an expression for words in full, stems with endings, and compounds with beginnings too."""
    ending = LETTER + "{0,10}"
    endless = [stem + ending for stem in stems.split()]
    within = [(ending if len(stem) > 4 else "") + stem + ending for stem in compounds.split()]
    return f"(?:{'|'.join(words.split() + endless + within)})(?:(?<={HAN})|(?!{LETTER}))"


WORDS = {kind: _words(**words) for kind, words in LISTS["harmless"].items()}
CHANGES = re.compile(
    "(?i)"
    rf"(?<!{LETTER}){_words(**LISTS['changes'])}|{LISTS['parts']}"
    # Numbers with a sign, a decimal comma, m, in or inch marks; lists of rows; percent, degree, doubt, arrows.
    r"|(?<![\w.)])[-\u2212\u2013]\d|[+\u00b1\u00d7*%\u00b0?=<>~\u2248\u2033\u2032\u2190-\u21ff\u221a\u2044^|]"
    rf"|(?:{WORDS['done']}|{WORDS['person']})\W+(?:\w+\W+){{0,3}}(?:from|fran|od|ab|tol)\W"
    # Measured, or a sample, in the rain; somebody's gauge.
    rf"|(?:{WORDS['done']}|{WORDS['origin']})[^.;]*(?:rain|regen|plui|lluv|piogg|chuv|deszcz|dest|дожд|雨)"
    rf"|'s {WORDS['tool']}"
    r"|\d\W?(?:m|in)(?!\w|\s+[a-z])|[\[(](?:m|in)[\])]|(?<!\w)in\W*$|(?<!\d{3})\d\s?['\"](?![td][ae])|\d,\d|1/10|order\W+\d+\W+\d"
)
EMPTY = re.compile(
    "(?i)"
    r"(?:^|(?<=[:;,.。\n]))\W*(?!(?:no|ei|нет|brak|in|a|da|to|report)\W*(?:$|[:;,.\n]))"
    rf"(?:(?:{WORDS['fine']}[ /]*)++|(?:{WORDS['empty']}[ /]*)++)(?=[:;,.。!\n]|$)"
)
ZERO_AT_FACE = re.compile(
    "(?i)"
    rf"(?=.*{WORDS['zero']})(?=.*{WORDS['face']})"
    rf"(?:{WORDS['zero']}|{WORDS['face']}|{WORDS['little']}|{WORDS['origin']}|auf|at|la|na|sul+a"
    r"|(?!no|ne|ei|up)[a-z]{1,2}(?![a-z])|[\s=:.-])+"
)
NUMBER = r"-?\d+(?:[.,]\d+)?"
FIGURES = re.compile(
    "(?i)"
    # Dates, and the word datum before these; times; addresses of mail.
    r"(?<!\w)datum(?=[^\d;]{1,14}(?:\d[\d. /-]*[^\d;]{0,12})?20\d\d)|"
    r"(?<![\w.,/-])(?:\d{4}[-/. ]{1,2}\d\d?[-/. ]{1,2}\d\d?|\d\d?([-/.]) ?\d\d?\1 ?(?:20)?\d\d|\d\d[/.]20\d\d)"
    r"(?![\w/-])|"
    r"\d{4}年\d\d?月(?:\d\d?日)?|"
    r"(?<![\w.,:])(?!1:)(?:[01]?\d|2[0-3])(?:[:h時点][0-5]\d(?::[0-5]\d|分)?|\s?(?:uhr|uur|[ap]m|点|時))(?![\w:])|"
    r"(?<!\w)(?:on|am|le|el|il|vom|dne|dnia|den) \d\d?[./]\d\d?(?![\d.,/])|"
    rf"\d\d?\.?\s(?:d[eo]\s)?{WORDS['month']}(?:\s20\d\d)?|"
    r"(?<!\w)[kp][km]\W*\d+[.,+]\d+|"
    rf"\d+\W{{0,2}}{WORDS['ordinal']}|(?<=\d)'[td][ae]\b|"
    rf"(?:top|bottom|(?:under|over|unter|ober|boven|onder)st?er?s?) (?={WORDS['number']})|"
    r"[\w.-]+@[\w.-]+|"
    rf"{NUMBER}\s*(?:°\s*C|gra[du]\w*|%\s*{WORDS['climate']})(?!\w)|"
    rf"{WORDS['climate']}[^;\d]{{0,20}}{NUMBER}\s*(?:°\s*C?|%|C|deg\w*|grad\w*|度)(?!\w)|"
    # "Page 2 of 3", as pages are sides in many languages; "no. 12"; the Portuguese "no".
    rf"(?<!\w)(?:[sp]|pag\w*|seite|str\w*|sid\w*|sivu|oldal|sayfa|{WORDS['number']})[. ]*\d+"
    r"\s?(?:of|[vd][aoe]n?|di|av|из|ze?|sur?|/)\s?\d+|"
    rf"(?<!\w)(?:n\.?°|(?:no|nr|n|c)[.: ]\s?(?=[A-Z]*\d)|no (?={WORDS['number']}))"
)
SIZE = re.compile(
    "(?i)"
    rf"({WORDS['tool']}\W|[,;(/])\s*(?:0\s?(?:-|\u2013|to|bis|\.+|a)\s?\d{{2,3}}|[1-9][05]0|0[.,]0+[125])\s?mm(?!\w)"
)
UPPER = r"[A-Z\u0410-\u042f]"
DATES_AND_NAMES = re.compile(
    rf"\d\d?\.?\s+(?:d[eo]\s+)?{LETTER}{{3,12}}\.?,?\s+(?:d[eo]\s+)?20\d\d|20\d\d\.?\s{LETTER}+\s\d\d?\.?(?!\w)"
    # A road from which a sample is; two words before what these measured.
    rf"|(?i:{WORDS['origin']} (?:(?:{WORDS['origin']}|{WORDS['little']}|[a-z]{{2}}) )*"
    rf"{WORDS['place']} (?:d[er]{{1,2}} |la )?)"
    rf"[A-Z]{{1,2}}[ -]?\d{{1,4}}(?:-\w+)?(?!\w)"
    rf"|^{UPPER}{LETTER}+ {UPPER}{LETTER}+ (?={WORDS['behind']}|{WORDS['done']})"
    rf"|{LETTER}{{3,9}}\s\d\d?,?\s20\d\d|\b{UPPER}{LETTER}+ (?:[\u0410-\u042f]\.\s?){{1,2}}"
    rf"|\b(?:{UPPER}\.[\s-]?){{1,3}}(?:(?:d[aei]l?|v[ao]n|der) ){{0,2}}{UPPER}{LETTER}+"
)
# Kinds of single words; the first four and the last four kinds are parts of the expressions above.
KIND = "|".join(f"(?P<{kind}>{WORDS[kind]})" for kind in list(WORDS)[4:-4])
CONTENT = set(WORDS) - {"little", "place"}
TOKEN = re.compile(
    rf"(?P<code>(?<=.){UPPER}(?![\w.])|"
    r"(?:[A-Z]{1,4}[-_]|[A-Z]{1,2} (?=\d{1,4}\b))?[A-Za-z\u0410-\u042f]{0,3}"
    r"\d[\dA-Za-z]*(?:[-./_][\dA-Za-z]+)*)"
    rf"|(?i:{KIND})|(?P<name>{HAN}|{LETTER}+)|(?P<mark>(?<={LETTER})'(?={LETTER})|[^\w\s'])|\S"
)


def changes(text: str) -> bool:
    """Return True if a text has a word or a sign that may change readings: unit, side, zero, factor, rejection."""
    return CHANGES.search(plain(text)) is not None


def is_harmless(text: str, sample: str = "") -> bool:
    """Return True only if a text is known to leave the readings of its sample as they are: a date, an operator.

    Unknown words, and numbers without a harmless label, give False.
    """
    text = text.lstrip("# ")
    if sample and sample_key(text) == sample_key(sample):
        return True
    if len(text) > LONGEST:
        return False
    if sample:
        text = re.sub(rf"(?<!\w){re.escape(sample)}(?![\w'*+?])", " ", text, flags=re.IGNORECASE)
    if ZERO_AT_FACE.fullmatch(plain(text)):
        return True
    text = EMPTY.sub(" ", SIZE.sub(r"\1 ", FIGURES.sub("§", plain(text))))
    return not CHANGES.search(text) and _is_known(DATES_AND_NAMES.sub("§", text))


def _is_known(text: str) -> bool:
    """Return whether all words are harmless, or names or numbers beside a label of these."""
    tokens = list(TOKEN.finditer(text))
    harmless_words = [token[0] for token in tokens if token.lastgroup in CONTENT]
    is_german = re.search(rf"(?i)(?<!\w){WORDS['german']}", text)
    is_title = text.isupper() or any(word[0].isupper() for word in harmless_words if not text.startswith(word))
    label, names, unlabelled = None, MOST_NAMES, 0
    before_kind, before_word = None, "."
    for token in tokens:
        kind, word = token.lastgroup, token[0]
        if kind in ("person", "titled") or (word == ":" and before_kind == "done"):
            label, names = kind, 0
        elif kind == "code":
            # A short number behind an instrument may be its reading, unless it is "no. 5".
            is_its_number = label == "tool" and (before_word == "§" or (word.isalnum() and len(word) > 3))
            if before_kind == kind or not (is_its_number or label in ("number", "titled")):
                return False
        elif kind == "name" and (len(word) > 2 or word > "\u3400" or not harmless_words):
            names += 1
            if names > MOST_NAMES:
                may_be_name = word[1:].islower() and before_kind != "place" and before_word not in ".:;"
                unlabelled += 1 if may_be_name else MOST_NAMES
            if not (word[0].isupper() or word >= "\u3400"):
                return False
        elif kind in CONTENT:
            label, names = kind, MOST_NAMES
        elif word == "," or (
            word in ".;:" and (before_kind == "code" or (before_kind == "name" and len(before_word) > 2))
        ):
            label, names = None, MOST_NAMES
        elif word == "§" or (is_german and kind == "little"):
            names = MOST_NAMES  # No name goes on behind a date or an initialled name
        elif kind is None or (kind == "mark" and word not in MARKS):
            return False
        before_kind, before_word = kind, word
    return unlabelled <= (
        MOST_UNLABELLED if any(map(str.islower, harmless_words)) and not (is_german or is_title) else 0
    )
