"""Read settings of a trial from the sentences of a note, and list the numbers that no rule reads.

A number is a setting only if all words around it are in the word list: "Der Riss ist ca. 9 mm tief" gives a depth,
"Dichtstoff 3 mm tief" does not. All other numbers with a unit, dates and times are returned as unread.
"""

import re
import tomllib
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from sealtwin.lab.note_words import (
    BY_WORD,
    CALLED,
    NEUTRAL,
    OF_SETTINGS,
    PER,
    SCALE,
    SETTINGS,
    UNITS,
    WordMeaning,
    known_keys,
    normal,
    read_value,
    unit_spelt,
)
from validate.readings.header_words import sample_key

SENTENCES = CALLED["sentences"]
SAMPLE, ABBREVIATIONS = (set(SENTENCES[name].split()) for name in ("sample", "abbreviations"))
BEHIND = {key: [normal(word) for word in words.split(",")] for key, words in SENTENCES["behind"].items()}
OTHER_UNITS = {unit_spelt(unit) for unit in SENTENCES["other_units"].split()}
ALL_UNITS = OTHER_UNITS.union(*UNITS.values())
PLACED = ("photo.ends_px", "date")  # Settings without a unit whose value is not a word
SYMBOLS = [(key, re.compile(rf"{letter}\s*[=:]\s*", re.IGNORECASE)) for key, letter in SENTENCES["symbols"].items()]

MONTH = SENTENCES["month"].replace("\n", "")
DATE = (
    r"\d{4}-\d\d?-\d\d?|(?:0?[1-9]|[12]\d|3[01])\.\s?(?:0?[1-9]|1[0-2])\.(?:\s?\d{4}|\d\d)?(?!\d)|\d\d?/\d\d?/\d{2,4}"
    rf"|\d\d?(?:\.|st|nd|rd|th)?\s?{MONTH}\.?,?(?:\s?\d{{4}})?|{MONTH}\.?\s\d\d?(?:st|nd|rd|th)?,?\s\d{{4}}"
)
TIME = r"\d\d?:\d\d(?::\d\d)?(?:\s?(?:uhr|h|am|pm)\b)?|\d\d?\s?h\s?\d\d\b"
ONE = (
    r"(?:(?<!\w)[-+\u2212])?"
    r"(?:\d{1,3}(?:[ \u00a0\u202f]\d{3})+(?!\d)(?:[.,]\d+)?|\d(?:[\d.,'\u2019]*\d)?(?:[eE][-+]?\d+)?)"
)
JOIN = (
    r"(?:\s?(?:mm|cm|m|in|\")?\s?[x\u00d7*]\s?"
    r"|\s?(?:-|\u2013|\u2014|\.{2,3}|\u2026|\u00b1|\+/?-|/|\bto\b|\bbis\b|\b\u00e0\b)\s?)"
)
QUANTITY = re.compile(
    rf"(?<!\d)(?<!\d[.,])(?:(?P<time>{TIME})|(?P<date>{DATE})|(?P<one>{ONE}(?:{JOIN}{ONE})*))", re.IGNORECASE
)
UNIT_WORD = re.compile(r"[\s\u00a0\u202f]?([^\s,;()\[\]|!?]{1,16})(?![^\s,;()\[\]|!?])")
ENDS = re.compile(rf"[;\n\r|]|,(?!\d)|[.!](?=\s|$)|\b(?:{'|'.join(SENTENCES['and'].split())})\b", re.IGNORECASE)
OTHER_MARKS = re.compile(r"[<>\u2264\u2265\u00b1?]")  # A bound or a doubt
SET = re.compile(r"^[ \t]*([A-Za-z_]+(?:\.[A-Za-z_]+)+)[ \t]*=[ \t]*(\S.*)$", re.MULTILINE)
MOST_WORDS = 20  # Limit of words before a number, and of numbers in a phrase
LONGEST_QUOTE = 60
LONGEST_TEXT = 20_000  # Letters of a text that are read


@dataclass(frozen=True)
class Quantity:
    """A number with its unit, or a date or a time, and its place in the text."""

    start: int
    end: int
    number: str
    unit: str  # "" if it has none
    is_time: bool  # True for a date, too


@dataclass
class NoteSentences:
    settings: dict[str, tuple[Any, str]] = field(default_factory=dict)
    """Values by dotted key, each with the phrase that gives it."""
    unread: list[str] = field(default_factory=list)
    """Quotations from the text that no rule reads: numbers with a unit, dates, times, and words of settings."""
    bare: list[str] = field(default_factory=list)
    """Numbers without a unit that belong to no setting, such as page numbers."""


def read_sentences(text: str, sample: str = "") -> NoteSentences:
    """Return the settings that the sentences of a text give for a sample. Numbers of other samples become unread."""
    reader = _Reader(text, sample)
    reader.read_keys()
    for start, end in reader.phrases:
        reader.read_words(start, end)
        reader.read_phrase(start, end)
    return reader.result()


def quantities(text: str) -> list[Quantity]:
    """Return all numbers of a text in order."""
    numbers, at = list[Quantity](), 0
    while (match := QUANTITY.search(text, at)) is not None:
        unit, at = ("", match.end()) if match["one"] is None else _unit_behind(text, match.end())
        numbers.append(Quantity(match.start(), at, match[0], unit, match["one"] is None))
    return numbers


def names_of_samples(text: str, samples: Iterable[str]) -> list[str]:
    """Return the samples that a text names; names without a digit are ignored, since they may be ordinary words."""
    words = normal(text)
    return [name for name in samples if re.search(r"\d", name) and re.search(rf"\b{_pattern(name)}\b", words)]


def _pattern(sample: str) -> str:
    """Return a pattern of a name that allows a blank between any two letters."""
    return " ?".join(normal(sample_key(sample)).replace(" ", ""))


def squeezed(text: str) -> str:
    """Return a quoted number without blanks and quotation marks, so that two quotations can be compared."""
    return re.sub(r"[\s\u00a0\u202f\"']+", "", text).casefold()


def _unit_behind(text: str, start: int) -> tuple[str, int]:
    """Return the unit that begins at ``start``, after a number, and the place of its end; "" and ``start`` if none."""
    words, at = list[re.Match[str]](), start
    while len(words) < 4 and (match := UNIT_WORD.match(text, at)) is not None:
        words.append(match)
        at = match.end()
    for count in range(len(words), 0, -1):
        parts = [word[1] for word in words[:count]]
        last = parts[-1].rstrip(".:")
        unit = " ".join([*parts[:-1], last])
        spelt, whole = unit_spelt(unit), count == 1 or any(part in PER or re.search(r"[/·*]", part) for part in parts)
        if spelt not in ALL_UNITS or not (whole or spelt in UNITS["pa_s"]):
            continue
        end = words[count - 1].start(1) + len(last)
        # "in" of "3 in der Mitte" is not inches.
        further = words[count][1] if count < len(words) else ""
        if spelt == "in" and words[0].start(1) > start and further[:1].isalpha() and not _is_behind(normal(further)):
            continue
        return unit, end
    return "", start


def _is_behind(words: str) -> bool:
    return any(words in each for each in BEHIND.values())


def _name_of(sample: str) -> re.Pattern[str]:
    """Return a pattern that finds a sample in its own note by its name, or by "sample" and a number in its name."""
    word = rf"(?:{'|'.join(SAMPLE)})"
    named = [rf"(?:{word} )?{_pattern(sample)}"] if sample else []
    named += [rf"{word} 0*{number}" for number in {str(int(digits)) for digits in re.findall(r"\d+", sample)}]
    return re.compile("|".join(rf"\b(?:{name})\b" for name in named) or r"(?!)")


class _Reader:
    """Reads one text phrase by phrase, and assigns its numbers and words to settings."""

    def __init__(self, text: str, sample: str) -> None:
        self.text, self.of_sample = text, _name_of(sample)
        self.numbers = quantities(text)
        self.starts = [one.start for one in self.numbers]
        self.used: dict[str, list[Quantity]] = {}  # Quantities of each setting
        self.sentences = NoteSentences()
        self.contested: set[str] = set()  # Settings with two different values
        self.words: list[tuple[int, str]] = []  # Places and phrases of settings with an invalid word

    def result(self) -> NoteSentences:
        used = {one for each in self.used.values() for one in each}
        unread = list(self.words)
        for one in self.numbers:
            if one in used or any(start <= one.start < start + len(phrase) for start, phrase in self.words):
                continue
            if one.unit or one.is_time:
                unread.append((one.start, " ".join(self.text[one.start : one.end].split())))
            elif quote := self._stated(one):
                unread.append((one.start, quote))
            elif not re.search(r"\w-?$", self.text[max(0, one.start - 2) : one.start]):
                self.sentences.bare.append(one.number)
        self.sentences.unread = list(dict.fromkeys(quote for _, quote in sorted(unread)))
        return self.sentences

    def read_keys(self) -> None:
        """Read lines that set a key of a trial, such as crack.depth_mm = 9."""
        for line in SET.finditer(self.text):
            if line[1] in known_keys():
                with suppress(tomllib.TOMLDecodeError):
                    value = tomllib.loads(f"value = {line[2]}")["value"]
                    self._take(line[1], value, line[0], self._between(line.start(), line.end()))

    @cached_property
    def phrases(self) -> list[tuple[int, int]]:
        """Start and end of each phrase: a sentence, or its parts between commas and "and"."""
        phrases, start = list[tuple[int, int]](), 0
        inside = {at for one in self.numbers for at in range(one.start, one.end)}
        for mark in ENDS.finditer(self.text):
            before = re.search(r"(\w+)$", self.text[max(start, mark.start() - 10) : mark.start()])
            short = mark[0] == "." and before is not None and before[1].casefold() in ABBREVIATIONS
            if mark.start() not in inside and not short:
                phrases.append((start, mark.start()))
                start = mark.end()
        return [*phrases, (start, len(self.text))]

    def read_words(self, start: int, end: int) -> None:
        """Read a setting without a unit: a date, the ends of the crack, or a choice of words."""
        phrase = self.text[start:end]
        for word in re.finditer(r"\S+", phrase):
            rest = phrase[word.start() :]
            for count in (4, 3, 2, 1):
                if (named := re.match(rf"\W*(?:[\w'\u2019-]+\W+){{{count}}}", rest)) is None:
                    continue
                meaning = BY_WORD.get(normal(named[0]))
                if meaning is None or not (meaning.choices or meaning.key in PLACED):
                    continue
                try:
                    value = read_value(meaning, rest[named.end() :].strip(), "")
                    self._take(meaning.key, value, phrase, self._between(start, end))
                except ValueError:
                    if re.search(r"[=:]\s*$", named[0]) and not self._between(start, end):
                        self.words.append((start, _quote(phrase)))
                return
            if self._rest(word[0]):
                return

    def read_phrase(self, start: int, end: int) -> None:
        """Read the numbers of a phrase by the words before and after each, or by a unit that only settings have."""
        taken = {one for each in self.used.values() for one in each}
        numbers = [one for one in self._between(start, end) if (one.unit or self._stated(one)) and one not in taken]
        if len(numbers) > MOST_WORDS:
            return
        begins = [start, *(one.end for one in numbers)]
        ends = [*(one.start for one in numbers), end]
        for place, one in enumerate(numbers):
            last = place == len(numbers) - 1
            behind = self.text[one.end : ends[place + 1]]
            follows = not last and self._by_words(behind, numbers[place + 1]) is not None
            follows_on = place == 0 or any(numbers[place - 1] in each for each in self.used.values())
            glued = self.text[max(0, one.start - 1) : one.start]
            if not follows_on or glued in {".", ","} or glued.isalpha():
                return
            before = self.text[begins[place] : one.start]
            read = self._by_words(before, one) or self._by_behind(before, behind, one) or self._by_unit(before, one)
            if read is not None and (follows or not self._rest(behind) or self._confirms(behind, read[0])):
                self._take(*read, self.text[begins[place] : ends[place + 1]], [one])

    def _by_words(self, before: str, one: Quantity) -> tuple[str, Any] | None:
        """Return the setting that a word before a number names, with its value, or None.

        All other words before the number must be neutral or its unit.
        """
        for key, symbol in SYMBOLS:
            rest = symbol.search(before)
            if rest is not None and not re.search(r"\w$", before[: rest.start()]):
                after = before[rest.end() :]
                if not self._rest(before[: rest.start()]) and not self._rest(after):
                    return self._read(SETTINGS[key], one, "")
        words = self._words(before)
        if words is None or len(words) > MOST_WORDS:
            return None
        spans = [(a, b) for a in range(len(words)) for b in range(a + 1, len(words) + 1)]
        for a, b in sorted(spans, key=lambda span: span[0] - span[1]):
            meaning = BY_WORD.get(" ".join(words[a:b]))
            if meaning is None or not meaning.unit:
                continue
            others = [word for word in words[b:] if word not in NEUTRAL]
            unit = unit_spelt(" ".join(others))
            if any(word not in NEUTRAL for word in words[:a]) or (others and unit not in UNITS[meaning.unit]):
                return None
            return self._read(meaning, one, unit)
        if unit_spelt(" ".join(word for word in words if word not in NEUTRAL)) in UNITS["mm_per_px"]:
            return self._read(SETTINGS[SCALE], one, "mm/px")
        return None

    def _by_behind(self, before: str, behind: str, one: Quantity) -> tuple[str, Any] | None:
        if self._rest(before) or not one.unit:
            return None
        key = next((key for key in BEHIND if self._confirms(behind, key)), None)
        return None if key is None else self._read(SETTINGS[key], one, "")

    def _by_unit(self, before: str, one: Quantity) -> tuple[str, Any] | None:
        if self._rest(before):
            return None
        unit = unit_spelt(one.unit)
        meanings = (each for each in SETTINGS.values() if each.unit in OF_SETTINGS and unit in UNITS[each.unit])
        return next((self._read(meaning, one, "") for meaning in meanings), None)

    def _read(self, meaning: WordMeaning, one: Quantity, unit: str) -> tuple[str, Any] | None:
        with suppress(ValueError):
            return meaning.key, read_value(meaning, f"{one.number} {one.unit}".strip(), unit)
        return None

    def _confirms(self, behind: str, key: str) -> bool:
        """Return True if the words after a number name the setting ``key`` and nothing else."""
        words = self._words(behind)
        if words is None:
            return False
        for phrase in BEHIND.get(key, ()):
            count = len(phrase.split())
            if " ".join(words[:count]) == phrase and all(word in NEUTRAL for word in words[count:]):
                return True
        return False

    def _rest(self, text: str) -> bool:
        """Return True if a text has words that may change the meaning of a number next to it."""
        words = self._words(text)
        return words is None or any(word not in NEUTRAL for word in words)

    def _words(self, text: str) -> list[str] | None:
        """Return the words of a text without the sample's name; None if it has a sign of a bound or doubt, like <."""
        if OTHER_MARKS.search(text):
            return None
        return self.of_sample.sub(" ", normal(text)).split()

    def _take(self, key: str, value: Any, phrase: str, ones: Sequence[Quantity]) -> None:
        if key in self.contested or (key in self.sentences.settings and self.sentences.settings[key][0] != value):
            # A setting with two values gets neither.
            self.contested.add(key)
            self.sentences.settings.pop(key, None)
            self.used.pop(key, None)
            return
        self.sentences.settings.setdefault(key, (value, _quote(phrase)))
        self.used.setdefault(key, []).extend(ones)

    def _stated(self, one: Quantity) -> str:
        """Return the phrase of a number without a unit if "=", ":" or a setting's word marks it as a value, or ""."""
        start, end = self.phrases[bisect_right(self.phrases, (one.start, len(self.text))) - 1]
        start, end = max(start, one.start - LONGEST_QUOTE), min(end, one.end + LONGEST_QUOTE)
        before = self.text[start : one.start]
        if any(self._confirms(self.text[one.end : end], key) for key in BEHIND):
            return _quote(self.text[one.start : end])
        words = normal(before).split()
        while words and (words[-1] in NEUTRAL or unit_spelt(words[-1]) in ALL_UNITS):
            del words[-1]
        named = any((word := BY_WORD.get(" ".join(words[at:]))) is not None and word.unit for at in range(len(words)))
        equals = re.search(r"[=:]\s*$", before) is not None and words[-1:] != [] and words[-1] not in SAMPLE
        return _quote(before + one.number) if named or equals else ""

    def _between(self, start: int, end: int) -> list[Quantity]:
        return self.numbers[bisect_left(self.starts, start) : bisect_left(self.starts, end)]


def _quote(text: str) -> str:
    quoted = " ".join(text.split())
    return quoted if len(quoted) <= LONGEST_QUOTE else f"{quoted[: LONGEST_QUOTE - 3]}..."
