"""Sheets of readings: that do not say what was meant, sound ones, and ones that ordinary labs write.

    python -m benchmarks.ingest [--seed 2027] [--sound 400] [--each 6]

Sheets that do not say what was meant, six in each manner, and sound ones are read with the length and the depth of
their crack. The sheets of seed 2027 are those that are judged; the checks were set on others.
Last, a lab takes in 22 sheets as ordinary labs write them. Their questions are answered in pairing.csv, and in no file
of the lab's.
"""

import csv
import re
import shutil
import tempfile
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from benchmarks.doubtful_sheets import MANNERS, DrawnSheet, sound_sheet
from benchmarks.ordinary_sheets import S_MM, SHEETS, levels_mm
from benchmarks.table import Row, run_benchmark
from sealtwin.core.errors import present
from sealtwin.core.progress import Progress
from sealtwin.lab.files import PAIRING
from sealtwin.lab.ingest import ingest
from sealtwin.trial.trial_file import load_trial
from tests.support.lab_folder import DEFAULTS, make_lab_folder
from validate.readings.grid import SheetFaults
from validate.readings.read_readings import read_readings
from validate.settings import Declared

MAX_ASKED, MAX_REMARKED = 1.0, 5.0  # Percent of the sound sheets that may be asked about, or have a remark
FEWEST_UNASKED = 11
UNREADABLE = 1  # Ordinary sheets to be edited: of formulas that no program has calculated, and of merged places
CONFIRMED = re.compile(r"as_written = ([\w ]+)\.")


def main(
    seed: Annotated[int, Option(help="seed of the doubtful and of the sound sheets")] = 2027,
    sound: Annotated[int, Option(help="sound sheets")] = 400,
    each: Annotated[int, Option(help="sheets in each manner")] = 6,
) -> list[Row]:
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        return [
            *doubt_rows(scratch / "doubtful", seed, each),
            *sound_rows(scratch, seed, sound),
            *ordinary_rows(scratch / "ordinary"),
        ]


@dataclass
class Tally:
    """What was said of sheets, counted: asked, named where it is wrong, something else remarked, or nothing."""

    counts: Counter[str] = field(default_factory=Counter)
    silent: list[str] = field(default_factory=list)

    def read(self, path: Path, sheet: DrawnSheet, name: str) -> None:
        try:
            doubts = read_readings(path, Declared(), sheet.length_mm, sheet.depth_mm).questions
        except SheetFaults as faults:
            doubts = faults.doubts
        parts = {part for doubt in doubts for part in (*doubt.cells, *doubt.answers.get("as_written", ()))}
        is_asked = any(not doubt.is_remark for doubt in doubts)
        is_named = not sheet.answers or parts & sheet.answers
        kind = "silent" if not doubts else "asked" if is_asked else "named" if is_named else "other"
        self.counts[kind] += 1
        if kind == "silent":
            self.silent.append(name)


def doubt_rows(folder: Path, seed: int, each: int) -> list[Row]:
    """Read sheets that do not say what was meant."""
    folder.mkdir()
    tally = Tally()
    for name, sheet in drawn(seed, each):
        tally.read(sheet.write(folder, "sheet"), sheet, name)
    counts, sheets = tally.counts, tally.counts.total()
    print(f"Silent: {Counter(tally.silent)}")
    return [
        Row(f"sheets of {len(MANNERS)} manners", sheets, "", len(MANNERS), len(MANNERS) * each),
        Row("asked about", counts["asked"], ""),
        Row("read, and remarked where it is wrong", counts["named"], ""),
        Row("read, and something else remarked", counts["other"], ""),
        Row("read wrong without a word", counts["silent"], "", 0, 0),
    ]


def drawn(seed: int, each: int) -> list[tuple[str, DrawnSheet]]:
    """Draw sheets in each manner, the same for one seed whichever other manners there are."""
    sheets = []
    for manner in MANNERS:
        random = np.random.default_rng([seed, *manner.name.encode()])
        sheets += [(manner.name, manner.draw(random)) for _ in range(each)]
    return sheets


def sound_rows(folder: Path, seed: int, count: int) -> list[Row]:
    random = np.random.default_rng([seed, count])
    tally = Tally()
    for _ in range(count):
        sheet = sound_sheet(random)
        tally.read(sheet.write(folder, "sheet"), sheet, "")
    asked, silent = (100 * tally.counts[kind] / count for kind in ("asked", "silent"))
    return [
        Row("sound sheets", count, "", 200),
        Row("sound sheets asked about", asked, "%", 0, MAX_ASKED),
        Row("sound sheets read with a remark", 100 - asked - silent, "%", 0, MAX_REMARKED),
    ]


def ordinary_rows(scratch: Path) -> list[Row]:
    """Take in a lab of ordinary sheets; answer in pairing.csv what it asks, and take it in again."""
    photo, folder, lab = make_lab_folder(scratch / "ten") / "P01.png", scratch / "folder", scratch / "lab"
    folder.mkdir()
    (folder / "lab.toml").write_text(DEFAULTS, encoding="utf-8")
    names = [f"Q{number:02d}" for number in range(len(SHEETS))]
    for number, (name, sheet) in enumerate(zip(names, SHEETS, strict=True)):
        sheet.write(folder / f"{name}{sheet.suffix}", levels_mm(number))
        shutil.copy(photo, folder / f"{name}.png")
    before = {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "lab.toml"}
    first = ingest(folder, lab, Progress())
    faults = {outcome.name: [*outcome.questions] for outcome in first.samples if outcome.questions}
    rows = list(csv.DictReader((lab / PAIRING).read_text(encoding="utf-8").splitlines()))
    answered = set[str]()
    for row in rows:
        sheet = SHEETS[names.index(row["sample"])]
        if row["role"] == "readings" and row["sample"] in faults:
            # Whoever wrote the sheet knows that its texts change nothing but what the answers say.
            confirmed = CONFIRMED.search(row["question"])
            row.update({"as_written": "" if confirmed is None else confirmed[1], **sheet.answers})
            answered |= {row["sample"]} if row["question"] else set()
    with (lab / PAIRING).open("w", encoding="utf-8", newline="") as pairing:
        writer = csv.DictWriter(pairing, list(dict.fromkeys(name for row in rows for name in row)))
        writer.writeheader()
        writer.writerows(rows)
    again = ingest(folder, lab, Progress())
    taken = {outcome.name for outcome in again.samples if not outcome.questions}
    remarked = {outcome.name for outcome in again.samples if outcome.remarks}
    wrong = [name for number, name in enumerate(names) if name in taken and not _as_written(lab / name, number)]
    wrong = [name for name in wrong if name not in remarked]
    unchanged = all((folder / name).read_bytes() == content for name, content in before.items())
    print("Ordinary sheets:")
    outcomes = {outcome.name: outcome for outcome in again.samples}
    for name, sheet in zip(names, SHEETS, strict=True):
        fate = "taken unedited" if name not in faults else "taken after an answer" if name in taken else "NOT TAKEN"
        print(f"  {sheet.manner}: {fate}{', READ WRONG' if name in wrong else ''}")
        for fault in faults.get(name, []) + ([] if name in taken else [*outcomes[name].questions]):
            print(f"    {fault}")
    count, sound = len(SHEETS), len(taken & set(names))
    return [
        Row(f"of {count} sheets of ordinary labs: taken unedited", sound, "", count - UNREADABLE, count),
        Row("of these without a question", len(set(names) - faults.keys()), "", FEWEST_UNASKED),
        Row("of these after an answer in pairing.csv", len(taken & answered), ""),
        Row("ordinary sheets read wrong without a word", len(wrong), "", 0, 0),
        Row("files of the lab that were changed", int(not unchanged), "", 0, 0),
    ]


def _as_written(trial: Path, number: int) -> bool:
    """Return whether a trial's readings are those that were written; one may be missing."""
    settings = present(load_trial(trial / "trial.toml").readings, "the readings")
    readings, expected_mm = read_readings(trial / settings.path, settings), levels_mm(number)
    repeats_mm = readings.level_mm[:, None] if readings.repeats_mm is None else readings.repeats_mm
    if (lost := np.isnan(repeats_mm)).sum() == 1:
        expected_mm[lost] = np.nan
    is_like = readings.s_mm.tolist() == list(S_MM) and repeats_mm.shape == expected_mm.shape
    return is_like and np.allclose(repeats_mm, expected_mm, atol=1e-9, equal_nan=True)


if __name__ == "__main__":
    run_benchmark(main)
