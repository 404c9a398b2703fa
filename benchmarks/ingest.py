"""A lab's folder of ten trials in ten dialects, all that was spoilt in it, and sheets that do not say what was meant.

``python benchmarks/ingest.py`` makes the folder, takes it in, takes it in again, and then one with faults planted. Of
sheets that do not say what was meant, two in each manner are a lab of their own, which is asked and answered; they and
sound ones are also read with the crack, the volume in it and a simulated level, as a run knows them. The sheets of seed
2027 are those that are judged; the screens were set on others.
"""

import argparse
import re
import shutil
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.doubtful_sheets import REVIEWED, VARIED, DrawnSheet, Manner, sound_sheet
from benchmarks.table import Row, finish
from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.core.progress import Progress
from sealtwin.lab.ingest import Ingested, ingest
from tests.lab_folder import DEFAULTS, ENDS, FAULTS, HANDS, make_lab_folder
from validate.readings.read_readings import read_readings
from validate.readings.sheet import SheetFaults
from validate.settings import Declared

FEWEST_DIALECTS, FEWEST_FAULTS = 6, 12
SLOWEST_S = 1.0
"""A sample: a hundred of them in the time of a coffee."""
JUDGED_SEED, SOUND_SHEETS, EACH = 2027, 400, 2
MOST_QUESTIONED = 5.0  # Percent of the sound sheets that may be questioned
ANSWER = re.compile(r"readings\.as_written = \[([^]]*)\]")


def main(scratch: Path, seed: int, sound: int, each: int) -> None:
    """Prints what was read and what was found; exits as every benchmark does."""
    folder = make_lab_folder(scratch / "sound")
    ingest(folder, scratch / "warm", Progress())
    began = time.perf_counter()
    first = ingest(folder, scratch / "lab", Progress())
    took_s = time.perf_counter() - began
    began = time.perf_counter()
    again = ingest(folder, scratch / "lab", Progress())
    again_s = time.perf_counter() - began

    spoilt = make_lab_folder(scratch / "spoilt")
    for fault in FAULTS:
        fault.plant(spoilt)
    told = "\n".join(ingest_answer(ingest(spoilt, scratch / "lab-of-spoilt", Progress())).lines)
    found = [re.search(f"^failed: .*{fault.says}.*$", told, flags=re.MULTILINE) for fault in FAULTS]

    print("Read as:")
    for outcome in first.outcomes:
        print(f"  {outcome.sample.name}  {outcome.dialect}")
    print("Planted, and what was said of it:")
    for fault, said in zip(FAULTS, found, strict=True):
        print(f"  {fault.what}\n    {'NOT NAMED' if said is None else said[0].removeprefix('failed: ')}")
    dialects = len({outcome.dialect for outcome in first.outcomes})
    finish(
        [
            Row("trials taken in", _count(first, "new"), "of 10", len(HANDS), len(HANDS)),
            Row("dialects", dialects, "", FEWEST_DIALECTS, len(HANDS)),
            Row("planted faults", len(FAULTS), "", FEWEST_FAULTS, 1000),
            Row("of these named", sum(said is not None for said in found), "", len(FAULTS), len(FAULTS)),
            Row("taken in again: new or revised", len(HANDS) - _count(again, "unchanged"), "", 0, 0),
            Row("time a sample", took_s / len(HANDS), "s", 0, SLOWEST_S),
            Row("time a sample that is known", again_s / len(HANDS), "s", 0, SLOWEST_S / 10),
            *doubt_rows(scratch / "doubtful", seed, each),
            *sound_rows(scratch, seed, sound),
            *asking_rows(scratch / "asked", seed),
        ]
    )


def _count(ingested: Ingested, fate: str) -> int:
    return sum(outcome.fate == fate for outcome in ingested.outcomes)


@dataclass
class Said:
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
    found = ANSWER.search(sentence)
    return [] if found is None else found[1].replace('"', "").split(", ")


def doubt_rows(folder: Path, seed: int, each: int) -> list[Row]:
    """Read sheets that do not say what was meant, as ingest does and as a run does."""
    folder.mkdir()
    rows = []
    for what, manners in (("reviewed", REVIEWED), ("varied", VARIED)):
        at_ingest, at_run = Said(), Said()
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
    at_ingest, at_run = Said(), Said()
    for _ in range(count):
        sheet = sound_sheet(random)
        path = sheet.write(folder, "sheet")
        at_ingest.read(path, sheet, "", run=False)
        at_run.read(path, sheet, "", run=True)
    shares = (100 * (1 - said.counts["silent"] / count) for said in (at_ingest, at_run))
    return [
        Row("sound sheets", count, "", 200),
        *(
            Row(f"sound sheets questioned {where}", share, "%", 0, MOST_QUESTIONED)
            for where, share in zip(("at ingest", "in the run"), shares, strict=True)
        ),
    ]


def asking_rows(scratch: Path, seed: int) -> list[Row]:
    """Take in a lab of doubtful sheets, answer each in one line of its note, and take it in again."""
    folder = make_lab_folder(scratch / "ten")
    photo = shutil.copy(folder / "P01.png", scratch / "photo.png")
    folder = scratch / "folder"
    folder.mkdir()
    (folder / "lab.toml").write_text(DEFAULTS, encoding="utf-8")
    for number, (_, sheet) in enumerate(drawn(REVIEWED, seed, EACH)):
        name = f"Q{number:02d}"
        sheet.write(folder, name)
        shutil.copy(photo, folder / f"{name}.png")
        note = f"crack.depth_mm = {sheet.depth_mm}\nphoto.ends_px = {ENDS}\n"
        (folder / f"{name}.toml").write_text(note, encoding="utf-8")
    first = ingest(folder, scratch / "lab", Progress())
    held = 0
    for outcome in first.outcomes:
        answers = [answer for fault in outcome.faults for answer in answers_in(fault)]
        if answers and all(map(answers_in, outcome.faults)):
            held += 1
            with (folder / f"{outcome.sample.name}.toml").open("a", encoding="utf-8") as note:
                note.write(f"readings.as_written = {answers}\n")
    again = ingest(folder, scratch / "lab", Progress())
    return [
        Row("a lab's samples of reviewed manners", len(first.outcomes), "", len(REVIEWED) * EACH),
        Row("of these held with a question", held, "", 1),
        Row("taken in after one line each", _count(again, "new"), "", held, held),
    ]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=JUDGED_SEED, help="seed of the doubtful and of the sound sheets")
    parser.add_argument("--sound", type=int, default=SOUND_SHEETS, help="sound sheets")
    parser.add_argument("--each", type=int, default=EACH, help="sheets in each manner")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        main(Path(scratch), asked.seed, asked.sound, asked.each)
