"""Public reports on trials, run folders and paths."""

import csv
import os
import shutil
from collections.abc import Callable
from contextlib import chdir
from pathlib import Path

import numpy as np
from PIL import Image

from tests.slow.reports.files import grey, lab, photo, small_crack, text
from tests.slow.reports.table import (
    LAB,
    LENGTH,
    TO,
    WIDE,
    WIDTH,
    Ended,
    held,
    refused,
    report,
    right,
    warned,
)
from tests.support import ingested_lab as labs
from tests.support.tiny_study import TRIAL

TRIAL_OF = f"digitise trial.toml {TO}"
PHOTO = "digitise photo.png --ends 40,150 460,160 --depth-mm 10 --mm-per-px 0.1"


def small_trial(folder: Path) -> Path:
    small_crack(folder / "crack.png")
    trial = folder / "trial.toml"
    trial.write_text(TRIAL.split("[readings]")[0], encoding="utf-8")
    return trial


def sealtwin(folder: Path, command: str) -> None:
    with chdir(folder):
        answer = labs.sealtwin(*command.split())
    assert answer.exit_code == 0, answer.output


def replanned(folder: Path, change: Callable[[list[list[float]]], list[list[float]]]) -> None:
    """Make a trial whose path is that of a digitised crack as a plan, its rows changed."""
    trial = small_trial(folder)
    sealtwin(folder, "digitise trial.toml --out before")
    names = ["t_s", "x_mm", "y_mm", "z_mm", "flow_mm3_s"]
    with (folder / "before" / "trajectory.csv").open(encoding="utf-8", newline="") as file:
        rows = [[float(row[name]) for name in names] for row in csv.DictReader(file)]
    rows = change(rows)
    text("plan.csv", ",".join(names), *(",".join(f"{cell:.9f}" for cell in row) for row in rows))(folder)
    path = "volume_ml = 0.08\nspeed_mm_s = 20\ntrim_mm = 1\n"
    trial.write_text(trial.read_text(encoding="utf-8").replace(path, 'plan = "plan.csv"\n'), encoding="utf-8")


PAUSE_S = 2.0


def pause_is_kept(ended: Ended) -> bool:
    """The trajectory has one pause, as long as in the plan."""
    if ended.code != 0:
        return False
    with (ended.out / "run" / "trajectory.csv").open(encoding="utf-8", newline="") as file:
        rows = [[float(row[name]) for name in ("t_s", "x_mm", "y_mm", "z_mm")] for row in csv.DictReader(file)]
    steps = np.diff(rows, axis=0)
    still_s = steps[np.linalg.norm(steps[:, 1:], axis=1) < 1e-6, 0].sum()
    return bool(abs(still_s - PAUSE_S) < 0.01)


def photo_is_kept(ended: Ended) -> bool:
    """The photo is unchanged, whatever the answer."""
    path = ended.out.parent / "given" / "photo.png"
    with path.open("rb") as file:
        return ended.code in (0, 3) and path.stat().st_size > 10_000 and file.read(4) == b"\x89PNG"


@report("nightlyone/lockfile/issues/25", "digitise trial.toml --json --out run", WIDE)
def lock_of_another(folder: Path) -> None:
    """The number in a stale lock belongs to another process, so that no run starts."""
    small_trial(folder)
    sealtwin(folder, "digitise trial.toml --out run")
    lock = folder / "run" / ".lock"
    lock.unlink(missing_ok=True)
    lock.write_text(f"{os.getpid()}\n")


@report(
    "JuliaLang/julia/pull/12559",
    "digitise photo.tif --depth-mm 10 --mm-per-px 0.1 --ends 40,150 460,160 --json --out run",
    right(WIDTH, 3.1, 0.25),
    refused("photo.tif"),
)
def photo_replaced_in_its_time(folder: Path) -> None:
    """The old result is used after a file is replaced by another file of the same time."""
    path = folder / "photo.tif"
    Image.fromarray(grey()).save(path)
    sealtwin(folder, "digitise photo.tif --depth-mm 10 --mm-per-px 0.1 --ends 40,150 460,160 --out run")
    before = path.stat()
    Image.fromarray(grey(30)).save(path)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_size == before.st_size


@report("whoenig/uav_trajectories/issues/1", TRIAL_OF, pause_is_kept, refused("plan.csv", "row|line"))
def path_with_a_pause(folder: Path) -> None:
    """A path with a pause stops the program."""

    def change(rows: list[list[float]]) -> list[list[float]]:
        half = len(rows) // 2
        late = [[t_s + PAUSE_S, *rest] for t_s, *rest in rows[half:]]
        return [*rows[:half], [*rows[half][:-1], 0.0], *late]

    replanned(folder, change)


# NaN passes the check of a range.
report(
    "pallets/click/issues/3347",
    f"digitise photo.png --ends 40,150 460,160 --depth-mm nan --mm-per-px 0.1 {TO}",
    refused("depth", "nan", codes=(2, 3)),
)(photo)


@report("pydantic/pydantic/issues/393", TRIAL_OF, refused("trial.toml", "path.speed_mm_s"))
def trial_with_true(folder: Path) -> None:
    """True is taken for the number 1."""
    trial = small_trial(folder)
    text = trial.read_text(encoding="utf-8")
    trial.write_text(text.replace("speed_mm_s = 20\n", "speed_mm_s = true\n"), encoding="utf-8")


# An output folder that is the input's is emptied first.
report("genid/Yleaf/issues/55", f"{PHOTO} --json --out .", photo_is_kept)(photo)


@report("NixOS/nix/issues/119", LAB, held("p01.png", "2 |two|twice|both"))
def twins_by_case(folder: Path) -> None:
    """Two photos have names that differ only in upper and lower case."""
    lab(folder)
    small_crack(folder / "other.png", seed=5)
    shutil.move(folder / "other.png", folder / "p01.PNG")


@report("hayamiz/perfmonger/issues/7", "simulate run --device cpu --json", refused("trajectory.csv"))
def path_cut_short(folder: Path) -> None:
    """A truncated file is read as complete."""
    small_trial(folder)
    sealtwin(folder, "digitise trial.toml --out run")
    path = folder / "run" / "trajectory.csv"
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


@report(
    "ArduPilot/ardupilot/issues/21409",
    TRIAL_OF,
    right(LENGTH, 14.2, 0.5),
    refused("plan.csv", "row|line"),
    warned("plan.csv"),
)
def path_of_near_twins(folder: Path) -> None:
    """Nearly equal points of a path end in an internal error."""

    def change(rows: list[list[float]]) -> list[list[float]]:
        half = len(rows) // 2
        return [*rows[: half + 1], list(np.add(rows[half], [1e-6, 1e-6, 0, 0, 0])), *rows[half + 1 :]]

    replanned(folder, change)
