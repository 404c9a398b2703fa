"""A lab's folder of ten trials in ten dialects, and sheets that do not say what was meant.

``python benchmarks/ingest.py`` makes the folder, takes it in and takes it in again. Of sheets that do not say what was
meant, two in each manner, and sound ones are read with the crack, the volume in it and a simulated level, as in a run.
The sheets of seed 2027 are those that are judged; the screens were set on others. Last, 24 sheets as ordinary labs
write them, whose questions are answered in pairing.csv, and in no file of the lab's; and a sheet of
10,000 stations.
"""

import csv
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
from typer import Option

from benchmarks.doubtful_sheets import REVIEWED, VARIED, DrawnSheet, Manner, sound_sheet
from benchmarks.ordinary_sheets import S_MM, SHEETS, levels_mm, write_rows
from benchmarks.table import Row, run_benchmark
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats, Profile
from sealtwin.lab.files import PAIRING
from sealtwin.lab.ingest import Ingested, ingest
from sealtwin.trial.trial_file import load_trial
from tests.support.lab_folder import DEFAULTS, ENDS, HANDS, make_lab_folder
from validate.readings.grid import SheetFaults
from validate.readings.read_readings import read_readings
from validate.settings import Declared

FEWEST_DIALECTS = 6
SLOWEST_S = 1.0
"""A sample: a hundred of them in the time of a coffee."""
JUDGED_SEED, SOUND_SHEETS, EACH = 2027, 400, 2
MOST_QUESTIONED = 5.0  # Percent of the sound sheets that may be questioned
FEWEST_UNASKED = 14
UNREADABLE = 1  # Ordinary sheets to be edited: of formulas that no program has calculated, and of merged places
ROUNDING_MM = 1e-9
CONFIRMED = re.compile(r"as_written = ([\w ]+)\.")
ANSWER = re.compile(r"readings\.as_written = \[([^]]*)\]")


def main(
    seed: Annotated[int, Option(help="seed of the doubtful and of the sound sheets")] = JUDGED_SEED,
    sound: Annotated[int, Option(help="sound sheets")] = SOUND_SHEETS,
    each: Annotated[int, Option(help="sheets in each manner")] = EACH,
) -> list[Row]:
    with tempfile.TemporaryDirectory() as scratch:
        return rows(Path(scratch), seed, sound, each)


def rows(scratch: Path, seed: int, sound: int, each: int) -> list[Row]:
    """Print what was read and what was found, and return the rows."""
    folder = make_lab_folder(scratch / "sound")
    ingest(folder, scratch / "warm", Progress())
    began = time.perf_counter()
    first = ingest(folder, scratch / "lab", Progress())
    took_s = time.perf_counter() - began
    began = time.perf_counter()
    again = ingest(folder, scratch / "lab", Progress())
    again_s = time.perf_counter() - began

    began = time.perf_counter()
    unready = [outcome for outcome in ingest(folder, scratch / "lab", Progress(), jobs=1).samples if outcome.questions]
    checked_s = time.perf_counter() - began

    print("Read as:")
    for outcome in first.samples:
        print(f"  {outcome.name}  {outcome.dialect}")
    dialects = len({outcome.dialect for outcome in first.samples})
    return [
        Row("trials taken in", _count(first, "new"), "of 10", len(HANDS), len(HANDS)),
        Row("dialects", dialects, "", FEWEST_DIALECTS, len(HANDS)),
        Row("taken in again: new or revised", len(HANDS) - _count(again, "unchanged"), "", 0, 0),
        Row("time a sample", took_s / len(HANDS), "s", 0, SLOWEST_S),
        Row("time a sample that is known", again_s / len(HANDS), "s", 0, SLOWEST_S / 10),
        Row(
            "sound samples that pass the checks of a run",
            len(HANDS) - len(unready),
            "of 10",
            len(HANDS),
            len(HANDS),
        ),
        Row("time a sample, traced and checked for its run", checked_s / len(HANDS), "s"),
        *doubt_rows(scratch / "doubtful", seed, each),
        *sound_rows(scratch, seed, sound),
        *ordinary_rows(scratch / "ordinary"),
        _stations_row(folder / "P01.png", scratch / "stations"),
    ]


def _count(ingested: Ingested, fate: str) -> int:
    return sum(outcome.fate == fate for outcome in ingested.samples)


@dataclass
class FilePlace:
    """What was said of sheets, counted: refused, named where it is wrong, something else in doubt, or nothing."""

    counts: Counter[str] = field(default_factory=Counter)
    silent: list[str] = field(default_factory=list)

    def read(self, path: Path, sheet: DrawnSheet, name: str, *, run: bool) -> None:
        length_mm, filling = (sheet.length_mm, sheet.filling) if run else (None, None)
        try:
            doubts = read_readings(path, Declared(), length_mm, sheet.depth_mm, filling).doubts
        except SheetFaults:
            self.counts["refused"] += 1
            return
        asked = {answer for doubt in doubts for answer in answers_in(doubt)}
        kind = "named" if asked and (not sheet.answers or asked & sheet.answers) else "other" if asked else "silent"
        self.counts[kind] += 1
        if kind == "silent":
            self.silent.append(name)


def answers_in(sentence: str) -> list[str]:
    """Return the answers that a doubt asks for."""
    match = ANSWER.search(sentence)
    return [] if match is None else match[1].replace('"', "").split(", ")


def doubt_rows(folder: Path, seed: int, each: int) -> list[Row]:
    """Read sheets that do not say what was meant, as ingest does and as a run does."""
    folder.mkdir()
    rows = []
    for what, manners in (("reviewed", REVIEWED), ("varied", VARIED)):
        at_ingest, at_run = FilePlace(), FilePlace()
        for name, sheet in drawn(manners, seed, each):
            path = sheet.write(folder, "sheet")
            at_ingest.read(path, sheet, name, run=False)
            at_run.read(path, sheet, name, run=True)
        sheets, silent = at_run.counts.total(), at_run.counts["silent"]
        print(f"Silent, {what}: at ingest {Counter(at_ingest.silent)}; in the run {Counter(at_run.silent)}")
        rows += [
            Row(f"sheets of {len(manners)} {what} manners", sheets, "", len(manners), len(manners) * each),
            Row(f"{what}: held by ingest, by its note alone", sheets - at_ingest.counts["silent"], ""),
            Row(f"{what}: refused", at_run.counts["refused"], ""),
            Row(f"{what}: named where it is wrong", at_run.counts["named"], ""),
            Row(f"{what}: something else in doubt", at_run.counts["other"], ""),
            Row(f"{what}: read wrong without a word", silent, "", 0, 0),
        ]
    return rows


def drawn(manners: Sequence[Manner], seed: int, each: int) -> list[tuple[str, DrawnSheet]]:
    """Draw sheets in each manner, the same for one seed whichever other manners there are."""
    sheets = []
    for manner in manners:
        random = np.random.default_rng([seed, *manner.name.encode()])
        sheets += [(manner.name, manner.draw(random)) for _ in range(each)]
    return sheets


def sound_rows(folder: Path, seed: int, count: int) -> list[Row]:
    random = np.random.default_rng([seed, count])
    at_ingest, at_run = FilePlace(), FilePlace()
    for _ in range(count):
        sheet = sound_sheet(random)
        path = sheet.write(folder, "sheet")
        at_ingest.read(path, sheet, "", run=False)
        at_run.read(path, sheet, "", run=True)
    shares = (100 * (1 - tally.counts["silent"] / count) for tally in (at_ingest, at_run))
    return [
        Row("sound sheets", count, "", 200),
        *(
            Row(f"sound sheets questioned {where}", share, "%", 0, MOST_QUESTIONED)
            for where, share in zip(("at ingest", "in the run"), shares, strict=True)
        ),
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
        (folder / f"{name}.toml").write_text(f"crack.depth_mm = 8.0\nphoto.ends_px = {ENDS}\n", encoding="utf-8")
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
    wrong = [name for number, name in enumerate(names) if name in taken and not _as_written(lab / name, number)]
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


def _stations_row(photo: Path, scratch: Path) -> Row:
    """Take in a sample of 15 stations by the command, and one of 10,000 along the same crack."""
    took_s = list[float]()
    for count in (15, 10_000):
        folder, random = scratch / f"{count}", np.random.default_rng(count)
        folder.mkdir(parents=True)
        shutil.copy(photo, folder / "P01.png")
        note = f"crack.depth_mm = 80.0\nphoto.ends_px = {ENDS}\nphoto.mm_per_px = 1.0\n"
        (folder / "P01.toml").write_text(note, encoding="utf-8")
        (folder / "lab.toml").write_text(DEFAULTS.replace("[photo]\nmm_per_px = 0.1\n", ""), encoding="utf-8")
        levels_mm = np.round(-20 + 0.05 * random.standard_normal((count, 3)), 2)
        s_mm = np.round(np.linspace(1, 118, count), 2)
        write_rows(
            folder / "P01.csv", [["s [mm]", *(f"level {k} [mm]" for k in (1, 2, 3))], *np.c_[s_mm, levels_mm].tolist()]
        )
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        command = [sys.executable, "-m", "sealtwin", "ingest", f"{folder}", "--out", f"{scratch / f'lab-{count}'}"]
        output = subprocess.run(command, check=False, capture_output=True, text=True).stdout
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert "; 3 repeats;" in " ".join(output.split()), output
        took_s.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return Row("processor time of 10,000 stations over that of 15", took_s[1] / took_s[0], "", 0, 4)


def _is_read(readings: Profile, s_mm: Sequence[float], expected_mm: Floats) -> bool:
    repeats_mm = readings.level_mm[:, None] if readings.repeats_mm is None else readings.repeats_mm
    is_like = readings.s_mm.tolist() == list(s_mm) and repeats_mm.shape == expected_mm.shape
    return is_like and np.allclose(repeats_mm, expected_mm, atol=ROUNDING_MM, equal_nan=True)


def _as_written(trial: Path, number: int) -> bool:
    """Return whether a trial's readings are those that were written; one may be missing."""
    settings = load_trial(trial / "trial.toml").readings
    assert settings is not None
    readings, expected_mm = read_readings(trial / settings.file, settings), levels_mm(number)
    if readings.repeats_mm is not None and (lost := np.isnan(readings.repeats_mm)).sum() == 1:
        expected_mm[lost] = np.nan
    return _is_read(readings, S_MM, expected_mm)


if __name__ == "__main__":
    run_benchmark(main)
