"""Trials, run folders, paths and robots."""

import csv
import json
import os
import re
import shutil
from collections.abc import Callable, Sequence
from contextlib import chdir
from pathlib import Path

import numpy as np
from PIL import Image

from tests.slow.reports.files import NOTE, WIDTH_PX, grey, lab, photo, small_crack, text
from tests.slow.reports.table import (
    CSV,
    LAB,
    LENGTH,
    ROBOT,
    THREE,
    TO,
    WIDE,
    WIDTH,
    Ended,
    Maker,
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


def robot_cell(points_mm: Sequence[Sequence[float]], samples_mm: Sequence[Sequence[float]], more: str = "") -> Maker:
    """Return a function that makes a digitised run and a cell file with those taught points."""

    def make(folder: Path) -> None:
        photo(folder)
        sealtwin(folder, f"{PHOTO} --out run")
        taught = "".join(
            f"[[taught]]\nsample_mm = {json.dumps(list(sample))}\nrobot_mm = {json.dumps(list(point))}\n"
            for sample, point in zip(samples_mm, points_mm, strict=True)
        )
        (folder / "cell.toml").write_text(CELL_HEAD + taught + CELL_REST + more, encoding="utf-8")
        rows = ["asked_mm3_s,weighed_g,time_s,delay_s"]
        # 20 s each, written in minutes.
        rows += [f"{flow},{flow * 20 * 1.69e-3 * part:.3f},0.3333,0.3" for flow in (100, 400) for part in (1, 1.01)]
        (folder / "pump.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")

    return make


CELL_HEAD = 'name = "bench"\nformats = ["csv"]\nframe_limit_mm = 0.5\n'
CELL_REST = """
[reach]
low_mm = [-300.0, -300.0, 0.0]
high_mm = [600.0, 600.0, 300.0]

[motion]
largest_speed_mm_s = 100.0
acceleration_mm_s2 = 200.0
approach_speed_mm_s = 20.0
safe_height_mm = 50.0
largest_tilt_deg = 5.0

[plunger]
diameter_mm = 20.0
travel_mm = 60.0
largest_speed_mm_s = 5.0

[gcode]

[urscript]
blend_mm = 0.1
dispenser = "digital"
port = 0
"""
MINUTES = '[pump]\nfile = "pump.csv"\ndensity_kg_m3 = 1690.0\n'
SAMPLE_CORNERS = ((0, 0), (50, 0), (0, 30))
CORNERS = ((250, -80, 55), (250, -30, 55), (220, -80, 55))
"""Of the sample in the robot's frame: its x is the robot's y, its y the robot's -x."""
SWAPPED = tuple((y, x, z) for x, y, z in CORNERS)
NEARLY_IN_LINE = ((0, 0), (50, 0), (25, 1))
ALMOST_ONE_LINE = ((250, -80, 55), (250, -30, 55), (249, -55, 55.05))
"""The third point 1 mm beside the line of the others, and touched 0.05 mm too high: the frame tilts by 2.9 degrees."""


def aged_material(*rows: str) -> Maker:
    """Return a function that makes a trial whose fluid is a table over age."""

    def make(folder: Path) -> None:
        trial = small_trial(folder)
        fluid = "U = 30.0\nD_cm = 0.3\n"
        content = trial.read_text(encoding="utf-8").replace(fluid, 'curve = "material.csv"\n')
        trial.write_text(content, encoding="utf-8")
        text("material.csv", "age_s,viscosity_pa_s,yield_stress_pa", *rows)(folder)

    return make


FOUR_CORNERS = (*SAMPLE_CORNERS, (50, 30))
ONE_TOO_HIGH = (*CORNERS, (220, -30, 60))
"""The fourth point touched 5 mm above the face."""
PAUSE_S = 2.0


def feed_is_of_the_path(ended: Ended) -> bool:
    """The G-code's feed along the path is the path's speed in mm/min."""
    if ended.code != 0:
        return False
    answer = json.loads(ended.stdout)
    (program,) = (ended.out / "robot").glob("*.gcode")
    feeds = [float(feed) for feed in re.findall(r"F([\d.]+)", program.read_text(encoding="utf-8"))]
    expected = 60 * answer["length_mm"] / answer["duration_s"]
    return any(abs(feed - expected) <= 0.1 * expected for feed in feeds) and min(feeds) > 0.5 * expected


def poses_are_metres_and_radians(ended: Ended) -> bool:
    """Positions below 1 m, and rotation vectors no longer than half a turn, the tool pointing down."""
    if ended.code != 0:
        return False
    (program,) = (ended.out / "robot").glob("*.script")
    written = re.findall(r"p\[([^\]]+)\]", program.read_text(encoding="utf-8"))
    poses = [[float(part) for part in one.split(",")] for one in written if re.fullmatch(r"[-\d.,e ]+", one)]
    turns = [float(np.linalg.norm(pose[3:])) for pose in poses if len(pose) == 6]
    return (
        bool(turns)
        and all(max(map(abs, pose[:3])) < 1 for pose in poses)
        and all(abs(turn - np.pi) < 0.01 for turn in turns)
    )


def pause_is_kept(ended: Ended) -> bool:
    """The trajectory stands still once, as long as was asked."""
    if ended.code != 0:
        return False
    with (ended.out / "run" / "trajectory.csv").open(encoding="utf-8", newline="") as file:
        rows = [[float(row[name]) for name in ("t_s", "x_mm", "y_mm", "z_mm")] for row in csv.DictReader(file)]
    steps = np.diff(rows, axis=0)
    still_s = steps[np.linalg.norm(steps[:, 1:], axis=1) < 1e-6, 0].sum()
    return bool(abs(still_s - PAUSE_S) < 0.01)


def photo_is_kept(ended: Ended) -> bool:
    """The photo is where it was, whole, whatever the answer."""
    path = ended.out.parent / "given" / "photo.png"
    with path.open("rb") as file:
        return ended.code in (0, 3) and path.stat().st_size > 10_000 and file.read(4) == b"\x89PNG"


def both_are_kept(ended: Ended) -> bool:
    """Each of two photos has its own folder, whether it could be traced or not."""
    return ended.code in (0, 6) and len({photo["folder"] for photo in json.loads(ended.stdout)["photos"]}) == 2


def begins_in_mm(ended: Ended) -> bool:
    """G21 stands before the first move, and G20 nowhere."""
    if ended.code != 0:
        return False
    (program,) = (ended.out / "robot").glob("*.gcode")
    words = program.read_text(encoding="utf-8").split()
    first = next(at for at, word in enumerate(words) if word in ("G0", "G00", "G1", "G01"))
    return "G21" in words[:first] and "G20" not in words


@report("evilsocket/pwnagotchi/issues/376", "digitise trial.toml --json --out run", WIDE, refused("manifest.json"))
def manifest_emptied(folder: Path) -> None:
    """A JSON of no bytes, after a power cut, stops every later start."""
    small_trial(folder)
    sealtwin(folder, "digitise trial.toml --out run")
    os.truncate(folder / "run" / "manifest.json", 0)


@report("nightlyone/lockfile/issues/25", "digitise trial.toml --json --out run", WIDE)
def lock_of_another(folder: Path) -> None:
    """The process of a stale lock has its number taken by another, and nothing starts any more."""
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
    """A file replaced by one that is not newer: the old result is taken for current."""
    path = folder / "photo.tif"
    Image.fromarray(grey()).save(path)
    sealtwin(folder, "digitise photo.tif --depth-mm 10 --mm-per-px 0.1 --ends 40,150 460,160 --out run")
    before = path.stat()
    Image.fromarray(grey(30)).save(path)
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert path.stat().st_size == before.st_size


# X and y are exchanged, and what is drawn is mirrored.
report(
    "Makeblock-official/mDrawBot/issues/31",
    ROBOT,
    refused("cell.toml", "mirror|underside|from below|exchanged|swapped"),
)(robot_cell(SWAPPED, SAMPLE_CORNERS))

# Poses that hardly differ in rotation make a calibration worthless.
report(
    "opencv/opencv/issues/24871",
    ROBOT,
    refused("cell.toml", "line|spread|narrow|apart"),
    warned("in line|one line|spread|narrow"),
)(robot_cell(ALMOST_ONE_LINE, NEARLY_IN_LINE))

# A feed is written in mm/s where the firmware takes mm/min.
report("teachingtechYT/teachingtechYT.github.io/pull/39", f"{ROBOT} --format gcode", feed_is_of_the_path)(
    robot_cell(CORNERS, SAMPLE_CORNERS)
)

# A rate per minute stands where one per hour is meant.
report("MIT-LCP/mimic.mit.edu/pull/36", ROBOT, refused("pump.csv"), warned("pump.csv", "times"))(
    robot_cell(CORNERS, SAMPLE_CORNERS, MINUTES)
)

# Degrees are passed on as radians.
report("NUbots/NUbots/pull/435", f"{ROBOT} --format urscript", poses_are_metres_and_radians)(
    robot_cell(CORNERS, SAMPLE_CORNERS)
)

# A table with two rows of one time is read, and one of them holds.
report(
    "opensim-org/opensim-core/issues/2536", f"run trial.toml --device cpu {TO}", refused("material.csv", "row 4|line 4")
)(aged_material("0,1,5", "10,2,8", "10,4,20", "20,8,40"))


@report("whoenig/uav_trajectories/issues/1", TRIAL_OF, pause_is_kept, refused("plan.csv", "row|line"))
def path_with_a_pause(folder: Path) -> None:
    """A path that stands still for a while stops the program."""

    def change(rows: list[list[float]]) -> list[list[float]]:
        half = len(rows) // 2
        late = [[t_s + PAUSE_S, *rest] for t_s, *rest in rows[half:]]
        return [*rows[:half], [*rows[half][:-1], 0.0], *late]

    replanned(folder, change)


# That a calibration by more than three points failed is not noticed.
report("robotology-legacy/wysiwyd/pull/70", ROBOT, refused("cell.toml", "taught|frame_limit|mm"))(
    robot_cell(ONE_TOO_HIGH, FOUR_CORNERS)
)

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


@report("BourgeoisLab/GPXLab/issues/29", TRIAL_OF, refused("plan.csv", "row|line|t_s|time"))
def path_of_swapped_times(folder: Path) -> None:
    """Times of a track that go backwards give wrong speeds."""

    def change(rows: list[list[float]]) -> list[list[float]]:
        half = len(rows) // 2
        return [*rows[:half], rows[half + 1], rows[half], *rows[half + 2 :]]

    replanned(folder, change)


@report("stellar/stellar-core/pull/404", TRIAL_OF, refused("trial.toml", "crack.mm_per_px"))
def trial_with_a_key_elsewhere(folder: Path) -> None:
    """A key behind the head of another table is that table's, and left out without a word."""
    trial = small_trial(folder)
    text = trial.read_text(encoding="utf-8").replace("mm_per_px = 0.1\n", "")
    trial.write_text(text.replace("[crack]\n", "[crack]\nmm_per_px = 0.1\n"), encoding="utf-8")


# An output folder that is the input's is emptied first.
report("genid/Yleaf/issues/55", f"{PHOTO} --json --out .", photo_is_kept)(photo)


@report(
    "tsduck/tsduck/issues/1740",
    f"digitise first/photo.png second/photo.png --depth-mm 10 --mm-per-px 0.1 {TO}",
    both_are_kept,
    refused("photo", "same name|one name|two|twice|both", codes=(2, 3)),
)
def photos_of_one_name(folder: Path) -> None:
    """Inputs of one name from two folders overwrite each other's results."""
    for name, width_px in (("first", WIDTH_PX), ("second", 30)):
        (folder / name).mkdir()
        photo(folder / name, width_px=width_px)


@report("NixOS/nix/issues/119", LAB, held("p01.png", "2 |two|twice|both"))
def twins_by_case(folder: Path) -> None:
    """Names that differ by case alone. Two photos whose names differ in large and small letters alone."""
    lab(folder, NOTE)
    small_crack(folder / "other.png", seed=5)
    shutil.move(folder / "other.png", folder / "p01.PNG")


# A program that does not state its unit runs in that of the program before.
report("OpenBuilds/OpenBuilds-CONTROL/issues/113", f"{ROBOT} --format gcode", begins_in_mm)(
    robot_cell(CORNERS, SAMPLE_CORNERS)
)


@report("emancu/toml-rb/issues/63", TRIAL_OF, refused("trial.toml", "crack|twice|line"))
def trial_with_a_table_twice(folder: Path) -> None:
    """A table that comes twice in a TOML is one of both."""
    trial = small_trial(folder)
    trial.write_text(trial.read_text(encoding="utf-8") + "\n[crack]\nmargin_mm = 15\n", encoding="utf-8")


# Infinity passes for a number of the command line.
report(
    "qarmin/czkawka/pull/2038",
    f"digitise photo.png --ends 40,150 460,160 --depth-mm 10 --mm-per-px inf {TO}",
    refused("mm-per-px", "inf", codes=(2, 3)),
)(photo)


@report("rakhimov/scram/issues/172", f"digitise sub/trial.toml {TO}", WIDE)
def trial_in_a_folder(folder: Path) -> None:
    """Paths of a configuration are taken from where the command runs."""
    (folder / "sub").mkdir()
    small_trial(folder / "sub")
    small_crack(folder / "crack.png", width_px=30)


@report("hayamiz/perfmonger/issues/7", "simulate run --device cpu --json", refused("trajectory.csv"))
def path_cut_short(folder: Path) -> None:
    """A file that was cut off is taken for whole."""
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
    """Points of a path that hardly differ end in an internal error."""

    def change(rows: list[list[float]]) -> list[list[float]]:
        half = len(rows) // 2
        return [*rows[: half + 1], list(np.add(rows[half], [1e-6, 1e-6, 0, 0, 0])), *rows[half + 1 :]]

    replanned(folder, change)


# A number with a comma that sets thousands apart is two cells.
report("SheetJS/sheetjs/issues/1852", CSV, THREE, refused("a.csv", "line 3|row 3"))(
    text("a.csv", "s_mm,level_mm", "995,-2.0", "1,005,-2.1", "1,015,-2.2")
)
