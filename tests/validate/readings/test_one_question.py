"""All that is open in a sheet comes at once: its own answers, put together, leave no further question."""

from typing import Any

import numpy as np
import pytest

from tests.validate.readings.conftest import answered

S = np.arange(0, 60, 4)
LEVEL = np.round(3.1 + np.sin(S / 9) + S / 300, 2)


def _rows(form: str = "{s};{a};{b}", changed: dict[int, str] | None = None, s_mm: Any = S) -> str:
    """Return rows of a sound profile, with some rows exchanged."""
    values = zip(s_mm, LEVEL, LEVEL + np.round(np.cos(S * 7) / 10, 2), strict=False)
    lines = [form.format(s=s, a=f"{a:.2f}", b=f"{b:.2f}") for s, a, b in values]
    return "\n".join((changed or {}).get(row, line) for row, line in enumerate(lines)) + "\n"


H = "s [mm];Tiefe 1 [mm];Tiefe 2 [mm]"
NO_WAY = "s [mm];Messung 1 [mm];Messung 2 [mm]\n"
OPEN = {"columns", "unit", "quantity"}
SHEETS = {
    "unknown names, a word": (
        "Fuß auf 5 mm Klotz\nwo;a;b\n" + _rows(changed={3: "12;feucht;3.1", 5: "20;nass;2.9"}),
        OPEN | {"cell", "remark"},
    ),
    "unknown names and flags": ("Ort;u;v;ok\n" + _rows("{s};{a};{b};ja", {3: "12;3.9;3.9;nein"}), OPEN | {"remark"}),
    "no unit, remark, slip of a number": (
        "s;Tiefe 1;Tiefe 2;Bemerkung\n" + _rows("{s};{a};{b};", {4: "16;3.1;3.l;", 6: "24;3.4;3.5;Ausreißer"}),
        {"unit", "cell", "remark"},
    ),
    "no direction, far station, zero": (
        NO_WAY + _rows(changed={7: "28;0;0", 14: "560;3.9;3.8"}),
        {"quantity", "outside", "outlier"},
    ),
    "direction and short span": (NO_WAY + _rows(s_mm=np.round(S / 10, 1)), {"quantity", "span"}),
    "two tables below each other": (
        f"P1\n{H}\n" + _rows(changed={4: "16;x;3.1"}) + f"\nP2, vom rechten Ende\n{H}\n" + _rows(),
        {"range", "cell", "remark"},
    ),
    "two tables beside each other": (
        f"{H};;{H}\n" + _rows("{s};{a};{b};;{s};{b};{a}", {2: "8;y;3.6;;8;3.6;3.7"}),
        {"range", "cell"},
    ),
    "several samples": (
        f"Probe;{H};Bemerkung\n"
        + _rows("P0;{s};{a};{b};")
        + _rows("lab;{s};{a};{b};", {5: "lab;20;3.8;3.7;verrutscht"})
        + _rows("P2;{s};{b};{a};"),
        {"range", "remark"},
    ),
    "rows that occur twice, in an unknown order": (
        "s [mm];Tiefe\n" + _rows("{s};{a}") + _rows("{s};{b}", {14: "0;3.2"}),
        {"unit", "twice"},
    ),
    "thousands": ("s [mm];Tiefe [mm]\n" + _rows("{s};{a}").replace(".", ",").replace("\n", "1\n"), {"decimal"}),
    "a number in the name, a total": ("s [mm];Tiefe 5 mm\n" + _rows("{s};{a}") + ";51.2\n", {"columns", "place"}),
    "signs in the name": ("s [mm];Tiefe (+5 mm)\n" + _rows("{s};{a}"), {"columns", "name", "quantity"}),
}


RANGES = {"P2": {"columns.range": "A2:C17"}, ";;": {"columns.range": "A1:C16"}, "(+5 mm)": {"columns.levels": ["B"]}}


@pytest.mark.parametrize(("text", "kinds"), SHEETS.values(), ids=SHEETS)
def test_one_round_of_answers_is_enough(doubts_of, text, kinds):
    own = next((own for kind, own in RANGES.items() if kind in text), {}) | {"columns.skip": [16]}
    doubts = doubts_of(text, 20.0, 60.0)
    assert {doubt.kind for doubt in doubts} == kinds
    assert all(doubt.answers for doubt in doubts)
    assert doubts_of(text, 20.0, 60.0, **answered(doubts, own=own)) == ()


def test_what_only_the_user_knows_is_left_open(doubts_of):
    (doubt,) = doubts_of(NO_WAY + _rows(), 20.0, 60.0)
    words = {"trial": "readings.quantity = ...", "pairing": "sign = ...", "python": "quantity=..."}
    assert all(text in doubt.in_words(reader) for reader, text in words.items())


NO_ANSWER = {
    "places that are no numbers": "Stelle [mm];Tiefe [mm]\n" + _rows("P{s};{a}"),
    "two units in a column": "s [mm];Tiefe\n" + _rows("{s};{a} mm", {3: "12;0.31 cm"}),
}


@pytest.mark.parametrize("text", NO_ANSWER.values(), ids=NO_ANSWER)
def test_what_no_answer_settles_says_what_to_do_to_the_file(doubts_of, text):
    doubts = doubts_of(text, 20.0, 60.0)
    unsettled = [doubt for doubt in doubts if not doubt.answers]
    assert unsettled
    assert all(doubt.remedy for doubt in unsettled)
    assert {doubt.kind for doubt in doubts_of(text, 20.0, 60.0, **answered(doubts))} == {
        each.kind for each in unsettled
    }
