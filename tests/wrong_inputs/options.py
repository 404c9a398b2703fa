"""Wrong values and names on the command line, and the same wrong values in a trial file."""

from collections.abc import Callable
from pathlib import Path

from tests.support.tiny_study import tiny_lab
from tests.wrong_inputs.table import WrongInput, answers

USAGE = 2


def trial(old: str = "", new: str = "") -> Callable[[Path], None]:
    """Return a maker of a trial, in which ``new`` replaces ``old``."""

    def make(folder: Path) -> None:
        file = tiny_lab(folder).with_name("trial.toml")
        text = file.read_text(encoding="utf-8")
        assert old in text
        file.write_text(text.replace(old, new), encoding="utf-8")

    return make


BELOW = "should be greater than 0.1"
BOX = ("Usage", "options:")
"""Words of a box about wrong usage, and of a message without an option's name."""
run = answers("run {given}/trial.toml --out {out} --device cpu")
photo = answers("digitise {given}/crack.png --mm-per-px 0.4 --out {out}")
robot = answers("robot {given} --cell none.toml")


def of_photo(words: str, *names: str, code: int = 3) -> WrongInput:
    return photo(words, trial(), *names, more=f" {words}", code=code, lacks=BOX if code == 3 else ())


# fmt: off
CASES: list[WrongInput] = [
    of_photo("--depth-mm -16", f"sealtwin: --depth-mm = -16: {BELOW}"),
    of_photo("--set crack.depth_mm=-16", f"sealtwin: --set crack.depth_mm = -16: {BELOW}"),
    run("negative depth in the file", trial("depth_mm = 8",
        "depth_mm = -16"), f"trial.toml: crack.depth_mm = -16: {BELOW}"),
    run("--set crack.depth_mm=-16", trial(), f"sealtwin: --set crack.depth_mm = -16: {BELOW}",
        more=" --set crack.depth_mm=-16"),
    of_photo("--depth-mm 1.6cm", "sealtwin: --depth-mm = '1.6cm'"),
    of_photo("--set crack.depth_mm=1.6cm", "sealtwin: --set crack.depth_mm = '1.6cm'"),
    of_photo("--depth-mm 1,000", "sealtwin: --depth-mm = '1,000'", "point"),
    of_photo("--depth-mm 8 --set crack.wall_angle_deg=11,8", "--set crack.wall_angle_deg = '11,8'", "point"),
    of_photo("--depth-mm 8 --ends 40,101 160", "--ends: has 1 values", "--ends X,Y X,Y"),
    of_photo("--depth-mm 8 --ends 40,101 160,nan", "--ends = 'nan'", "--ends X,Y X,Y"),
    of_photo("--depth-mm 8 --ends 40 101 160 98", "160 98", "--ends X,Y X,Y", code=USAGE),
    of_photo("--depth-mm 8 --face-mm 160x4cm", "--face-mm = '4cm'", "--face-mm WxH"),
    of_photo("--depth-mm 8 --roi 1,2,3", "--roi: has 3 values", "--roi 'X,Y ...'"),
    of_photo("--depth-mm 8 --set crack.tillt=lean", "sealtwin: --set crack.tillt: no such key", "'tilt'"),
    of_photo("--depth-mm 8 --set crack=3", "crack.KEY=VALUE", code=USAGE),
    of_photo("--depth-mm 8 --sed 3", "--sed", code=USAGE),
    of_photo("--depth-mm 8 --depth-mm 9", "--depth-mm is given 2 times", code=USAGE),
    of_photo("--mask none.png", "--depth-mm"),
    run("--seed 1.5", trial(), "sealtwin: --seed = 1.5", more=" --seed 1.5"),
    run("--threads 0", trial(), "sealtwin: --threads = 0", more=" --threads 0"),
    run("--preset fast", trial(), "sealtwin: --preset = 'fast'", "'draft'", more=" --preset fast"),
    robot("--format step", trial(), "sealtwin: --format = 'step'", "'urscript'", more=" --format csv,step"),
    answers("calibrate {given}/trial.toml --free")("--free", trial(), "--free fluid.U = '3-30'", "SETTING=LOW:HIGH",
        more=" fluid.U=3-30"),
    answers("markers --face-mm 160x40 --out frame.txt")("--out", trial(), "sealtwin: --out = 'frame.txt'", ".pdf"),
    run("decimal comma in the file", trial("depth_mm = 8", "depth_mm = 8,5"), "trial.toml: not valid TOML",
        "depth_mm = 8,5", "point"),
    run("decimal comma in quotes", trial("depth_mm = 8", 'depth_mm = "8,5"'), "trial.toml: crack.depth_mm = '8,5'",
        "point"),
]
# fmt: on
