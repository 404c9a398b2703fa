"""Sixty public reports of inputs that went wrong in other software, each as a file of that form: what sealtwin answers.

    python -m benchmarks.public_reports [--only KIND|WORD ...]

Files are made by ``benchmarks.reported_files``. What a sound answer is was decided before any of them ran: a right
figure, a refusal that names file and cause, or a warning that does. A wrong or assumed figure without a word is
wrong, and so is a traceback.
"""

import argparse
import csv
import json
import re
import tempfile
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks import reported_files as files
from benchmarks.reproductions import LIMIT_S, last_words, run_in
from benchmarks.table import Row, leave

NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")


@dataclass(frozen=True)
class Ended:
    """An answer: its exit code, its words in small letters, what it printed on stdout, its folder for files."""

    code: int
    words: str
    stdout: str
    out: Path

    def says(self, words: Sequence[str]) -> bool:
        """Tell if each of the words is there; those between bars are alternatives."""
        return all(any(one in self.words for one in word.split("|")) for word in words)


Check = Callable[[Ended], bool]
Figures = Callable[[Ended], Sequence[float]]


@dataclass(frozen=True)
class Report:
    address: str
    """On github.com."""
    there: str
    """What went wrong there."""
    make: files.Maker
    command: str
    sound: tuple[Check, ...]
    """Any of them."""


def refused(*words: str, codes: tuple[int, ...] = (3,)) -> Check:
    return lambda ended: ended.code in codes and ended.says(words)


def held(*words: str) -> Check:
    """Of a lab's folder: a sample held back, with the reason."""
    return refused(*words, codes=(3, 6))


def right(figures: Figures, values: float | Sequence[float], within: float, *words: str) -> Check:
    def check(ended: Ended) -> bool:
        if ended.code != 0 or not ended.says(words):
            return False
        seen, expected = np.atleast_1d(figures(ended)), np.atleast_1d(values)
        return seen.shape == expected.shape and bool(np.all(np.abs(seen - expected) <= within))

    return check


def warned(*words: str, codes: tuple[int, ...] = (0,)) -> Check:
    return refused(*words, codes=codes)


def figure(*keys: str) -> Figures:
    """Figures of --json's object."""
    return lambda ended: [float(json.loads(ended.stdout)[key]) for key in keys]


def numbers(ended: Ended) -> Sequence[float]:
    """All numbers of an array that was printed."""
    return [float(text) for text in NUMBER.findall(ended.stdout)]


def settings(key: str, *samples: str) -> Figures:
    """A setting of the trials that 'sealtwin ingest' wrote, NaN for a sample without one."""

    def look(ended: Ended) -> Sequence[float]:
        found = []
        for sample in samples:
            (trial,) = sorted((ended.out / "lab").glob(f"{sample}*/trial.toml")) or [None]
            table = {} if trial is None else tomllib.loads(trial.read_text(encoding="utf-8"))
            for part in key.split("."):
                table = table.get(part, {})
            found.append(float(table) if isinstance(table, int | float) else float("nan"))
        return found

    return look


def interval_holds(*yields_pa: float) -> Check:
    """The stated 95 % interval of the yield stress holds all of these."""

    def check(ended: Ended) -> bool:
        if ended.code != 0:
            return False
        low, high = json.loads(ended.stdout)["yield_stress_95_pa"]
        return all(low <= value <= high for value in yields_pa)

    return check


def interval_holds_paste(yield_pa: float, viscosity_pa_s: float) -> Check:
    """The stated intervals hold the paste's yield stress and viscosity."""
    of_yield = interval_holds(yield_pa)

    def check(ended: Ended) -> bool:
        if not of_yield(ended):
            return False
        answer = json.loads(ended.stdout)
        error = answer["viscosity_pa_s"] * answer["viscosity_error_percent"] / 100
        return abs(answer["viscosity_pa_s"] - viscosity_pa_s) <= 2 * error

    return check


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


def mean_depth_is(depth_mm: float) -> Check:
    """The cavity's volume over width and length, within 0.4 mm, which the rounded ends take."""

    def check(ended: Ended) -> bool:
        if ended.code != 0:
            return False
        answer = json.loads(ended.stdout)
        seen_mm = answer["cavity_volume_mm3"] / answer["mean_width_mm"] / answer["length_mm"]
        return abs(seen_mm - depth_mm) <= 0.4

    return check


def pause_is_kept(ended: Ended) -> bool:
    """The trajectory stands still once, as long as was asked."""
    if ended.code != 0:
        return False
    with (ended.out / "run" / "trajectory.csv").open(encoding="utf-8", newline="") as file:
        rows = [[float(row[name]) for name in ("t_s", "x_mm", "y_mm", "z_mm")] for row in csv.DictReader(file)]
    steps = np.diff(rows, axis=0)
    still_s = steps[np.linalg.norm(steps[:, 1:], axis=1) < 1e-6, 0].sum()
    return bool(abs(still_s - files.PAUSE_S) < 0.01)


def has_levels(*sets: Sequence[float]) -> Check:
    """The levels printed are one of these sets, in any order."""
    return lambda ended: (
        ended.code == 0
        and any(
            len(numbers(ended)) == len(levels) and np.allclose(sorted(numbers(ended)), sorted(levels), atol=0.001)
            for levels in sets
        )
    )


TO = "--json --out {out}/run"
SCALED = f"--depth-mm 10 --mm-per-px 0.1 {TO}"
CLICKED = f"--ends 40,150 460,160 {SCALED}"
LINE = f"--width-mm 1 --depth-mm 10 {TO}"
MM3 = figure("cavity_volume_mm3")
WIDTH = figure("mean_width_mm")
LENGTH = figure("length_mm")
SLOT = right(MM3, files.LONG_SLOT_MM3, 24)
LAB = "ingest . --out {out}/lab"
PASTE = "material rheometer curve.csv --density-kg-m3 1690 --data synthetic --json --out {out}/m.toml"
ROBOT = "robot run --cell cell.toml --json --out {out}/robot"
TWELVE = right(figure("yield_stress_pa", "viscosity_pa_s"), (12, 1.5), 0.1)

REPORTS = {
    "photos": (
        Report(
            "divamgupta/image-segmentation-keras/issues/11",
            "masks resized bilinearly hold values between the labels",
            files.mask_enlarged,
            f"digitise photo.png --mask mask.png {SCALED}",
            (right(WIDTH, 2.1, 0.3), refused("mask.png", "grey|values|between")),
        ),
        Report(
            "CodeWithKyrian/transformersphp-background-removal/issues/4",
            "a mask comes out inverted now and then",
            files.mask_inverted,
            f"digitise photo.png --mask mask.png {SCALED}",
            (refused("mask.png", "white on black|inverted|the other way"), right(WIDTH, 2.1, 0.2, "invert|white")),
        ),
        Report(
            "jimp-dev/jimp/issues/816",
            "of a TIFF with several pages the first is taken, without a word",
            files.two_pages,
            f"digitise photo.tif {CLICKED}",
            (refused("photo.tif", "page"), warned("page")),
        ),
        Report(
            "d2phap/ImageGlass/issues/1077",
            "a TIFF's tag of orientation is not respected",
            files.turned_tiff,
            f"digitise photo.tif {CLICKED}",
            (right(LENGTH, files.CRACK_MM, 1.5), refused("photo.tif", "orientation|turned|rotat|tag 274")),
        ),
        Report(
            "tokenrove/imago/issues/4",
            "a PNG of 16 bits is read as zeros",
            files.mask_of_16_bits,
            f"digitise photo.png --mask mask.png {SCALED}",
            (right(WIDTH, 2.1, 0.2), refused("mask.png", "16|more than 8 bits")),
        ),
    ),
    "drawings": (
        Report(
            "CadQuery/cadquery/pull/1384",
            "part of an ellipse with a reversed normal is drawn mirrored",
            files.dxf_reversed_ellipse,
            f"import-dxf a.dxf --line CENTRELINE {LINE}",
            (right(LENGTH, 30 + files.QUARTER_ELLIPSE_MM, 1.5), refused("a.dxf", "normal|extrusion|from below")),
        ),
        Report(
            "ixmilia/dxf/issues/107",
            "accents of layer names in ANSI_1252 become question marks",
            files.dxf_codepage,
            f"import-dxf a.dxf --line Repère {LINE}",
            (right(LENGTH, 60, 1.5),),
        ),
        Report(
            "KLayout/klayout/issues/704",
            "weights of a rational spline are ignored",
            files.dxf_rational_spline,
            f"import-dxf a.dxf --line CENTRELINE {LINE}",
            (right(LENGTH, files.conic_mm(), 1.5), refused("a.dxf", "rational|weight")),
        ),
        Report(
            "haplokuon/netDxf/issues/441",
            "a closed periodic spline without weights cannot be read",
            files.dxf_periodic_spline,
            f"import-dxf a.dxf --outline OUTLINE --depth-mm 10 {TO}",
            (right(MM3, 10 * files.ring_mm2(), 0.02 * 10 * files.ring_mm2()), refused("a.dxf", "periodic")),
        ),
        Report(
            "GridSpace/grid-apps/pull/521",
            "dimensions and other aids of a drawing are taken for contours",
            files.dxf_with_dimensions,
            f"import-dxf a.dxf --outline OUTLINE --depth-mm 10 {TO}",
            (right(MM3, 2400, 24), refused("a.dxf", "dimension|text|point")),
        ),
    ),
    "meshes": (
        Report(
            "mikedh/trimesh/pull/2560",
            "concave polygons of an OBJ are cut into a fan that covers their notches",
            files.obj_of_polygons,
            f"import-mesh block.obj --units mm {TO}",
            (SLOT, refused("block.obj", "polygon|concave|more than three corners|triangles")),
        ),
        Report(
            "assimp/assimp/issues/4976",
            "a node scaled by -1 turns the mesh inside out",
            files.glb_mirrored,
            f"import-mesh block.glb --units mm {TO}",
            (SLOT, refused("block.glb", "inside out|mirror|negative")),
        ),
        Report(
            "prusa3d/PrusaSlicer/issues/15842",
            "a 3MF that states centimetres is taken as millimetres",
            files.three_mf_in_cm,
            f"import-mesh block.3mf --units mm {TO}",
            (refused("block.3mf", "centimeter|unit is cm"), warned("centimeter|unit is cm"), SLOT),
        ),
        Report(
            "mrdoob/three.js/issues/14937",
            "a PLY with fewer faces than its header says loads as nothing",
            files.ply_cut_short,
            f"import-mesh block.ply --units mm {TO}",
            (
                refused("block.ply", "cut short|ends early|ends before|truncated|fewer|shorter|header|length"),
                right(MM3, files.LONG_SLOT_MM3, 24, "repair|filled|closed|missing"),
            ),
        ),
        Report(
            "Genesis-Embodied-AI/genesis-world/pull/2237",
            "a GLB is y upward by its specification, and lies on its side where z is up",
            files.glb_y_up,
            f"import-mesh block.glb --units m {TO}",
            (SLOT, refused("block.glb", "--up|y-up|axis")),
        ),
    ),
    "sheets": (
        Report(
            "pola-rs/polars/issues/28163",
            "the minus U+2212 beside decimal commas makes text of a column",
            files.text("a.csv", "s_mm;level_mm", "5,0;−2,15", "10,0;−2,25", "15,0;−2,05"),  # noqa: RUF001
            'st.read_readings("a.csv").level_mm',
            (right(numbers, (-2.15, -2.25, -2.05), 0.001), refused("a.csv", "line 2|row 2")),
        ),
        Report(
            "apache/ofbiz-framework/pull/845",
            "after a narrow blank as thousands' mark the rest of a number is dropped: 29 000 is 29",
            files.text("a.csv", "s_mm;level_mm", "990,5;-2,15", "1\u202f010,5;-2,25", "1\u202f030,5;-2,05"),
            'st.read_readings("a.csv").s_mm',
            (right(numbers, (990.5, 1010.5, 1030.5), 0.001), refused("a.csv", "line 3|row 3")),
        ),
        Report(
            "ExcelDataReader/ExcelDataReader/issues/40",
            "a cell that shows 0.5% is read as 0.005",
            files.percent_cells,
            LAB,
            (held("p01.xlsx", "%|percent"),),
        ),
        Report(
            "pandas-dev/pandas/issues/9424",
            "of two columns of one name the last one's values replace the first one's",
            files.text("a.csv", "s_mm,level_mm,level_mm", "5,-2.0,-2.4", "10,-2.1,-2.5", "15,-2.2,-2.6"),
            'st.read_readings("a.csv").level_mm',
            (right(numbers, (-2.2, -2.3, -2.4), 0.001), refused("a.csv", "level_mm")),
        ),
        Report(
            "manybabies/mb2-analysis/issues/89",
            "a header in the middle, of files that were joined, becomes missing values",
            files.text("a.csv", "s_mm,level_mm", "5,-2.0", "10,-2.1", "s_mm,level_mm", "15,-2.2", "20,-2.3"),
            'st.read_readings("a.csv").level_mm',
            (right(numbers, (-2.0, -2.1, -2.2, -2.3), 0.001), refused("a.csv", "line 4|row 4|header")),
        ),
    ),
    "notes": (
        Report(
            "dylanwal/unit_parse/issues/13",
            "of 'Between 10 and 20' the first number is taken",
            files.noted("between 7 and 9 mm"),
            LAB,
            (held("p01_notes", "between 7 and 9"),),
        ),
        Report(
            "lfoppiano/grobid-quantities/issues/166",
            "an approximate quantity is read as an exact one",
            files.noted("ca. 8 mm"),
            LAB,
            (held("p01_notes", "ca. 8"), right(settings("crack.depth_mm", "P01"), 8, 0, "ca. 8")),
        ),
        Report(
            "olbrich/ruby-units/issues/276",
            "a fraction behind a whole number: the whole is dropped",
            files.noted("1 1/4 in"),
            LAB,
            (held("p01_notes", "1 1/4"), right(settings("crack.depth_mm", "P01"), 31.75, 0.001)),
        ),
        Report(
            "convert-units/convert-units/issues/352",
            "the Greek letter mu is not the micro sign, and its unit is not known",
            files.greek_mu,
            LAB,
            (right(settings("photo.mm_per_px", "P01"), 0.1, 1e-9), held("p01_notes", "μm/px|scale")),
        ),
        Report(
            "bigbio/proteomics-sample-metadata/issues/423",
            "of a file with several samples one is used for all",
            files.one_note_of_two,
            LAB,
            (right(settings("crack.depth_mm", "P01", "P02"), (8, 12), 0), held("notes.csv"), held("crack.depth_mm")),
        ),
    ),
    "processes": (
        Report(
            "alvinunreal/oh-my-opencode-slim/issues/1028",
            "a configuration saved by Notepad with a byte order mark is ignored",
            files.trial_by_notepad,
            f"digitise trial.toml {TO}",
            (right(WIDTH, 2.1, 0.2), refused("trial.toml", "byte order mark|bom|utf-8")),
        ),
        Report(
            "evilsocket/pwnagotchi/issues/376",
            "a JSON of no bytes, after a power cut, stops every later start",
            files.manifest_emptied,
            "digitise trial.toml --json --out run",
            (right(WIDTH, 2.1, 0.2), refused("manifest.json")),
        ),
        Report(
            "nightlyone/lockfile/issues/25",
            "the process of a stale lock has its number taken by another, and nothing starts any more",
            files.lock_of_another,
            "digitise trial.toml --json --out run",
            (right(WIDTH, 2.1, 0.2),),
        ),
        Report(
            "huangruiteng/loopx/issues/3121",
            "one dangling link ends the whole scan of a folder",
            files.dangling_link,
            LAB,
            (
                lambda ended: (
                    ended.says(["p02.png"])
                    and ended.code in (0, 3, 6)
                    and settings("crack.depth_mm", "P01")(ended) == [8]
                ),
            ),
        ),
        Report(
            "JuliaLang/julia/pull/12559",
            "a file replaced by one that is not newer: the old result is taken for current",
            files.photo_replaced_in_its_time,
            "digitise photo.tif --depth-mm 10 --mm-per-px 0.1 --ends 40,150 460,160 --json --out run",
            (right(WIDTH, 3.1, 0.25), refused("photo.tif")),
        ),
    ),
    "rheometers": (
        Report(
            "pauliacomi/pyGAPS/issues/3",
            "the way up and the way down of one measurement are taken for one branch",
            files.flow_curve(*files.UP_AND_DOWN),
            PASTE,
            (
                refused("curve.csv", "sweep|twice|branch|hystere|thixotrop|loop|way up|way down"),
                warned("sweep|twice|branch|hystere|thixotrop|loop|way up|way down"),
                interval_holds(10, 20),
            ),
        ),
        Report(
            "ngscopeclient/scopehal/issues/940",
            "a second line of header, the units, is taken for data",
            files.flow_curve("1/s,mPa", *(f"{rate},{1000 * (12 + 1.5 * rate):g}" for rate in files.RATES)),
            PASTE,
            (refused("curve.csv", "line 2|row 2|mpa"), TWELVE),
        ),
        Report(
            "sPHENIX-Collaboration/coresoftware/pull/204",
            "saturated samples are part of a fit",
            files.flow_curve(*files.SATURATED),
            PASTE,
            (
                refused("curve.csv", "satur|plateau|same stress|levels off|limit|bend|no line"),
                warned("satur|plateau|same stress|levels off|limit|bend"),
                interval_holds_paste(12, 1.5),
            ),
        ),
        Report(
            "MaCFP/matl-db/pull/124",
            "columns in another order, and thousands of empty rows behind them",
            files.flow_curve(
                *(f"{12 + 1.5 * rate:g},{rate}" for rate in files.RATES),
                *[","] * 4000,
                header="stress_pa,shear_rate_per_s",
            ),
            PASTE,
            (TWELVE, refused("curve.csv", "line 13|row 13|empty")),
        ),
        Report(
            "mholt/PapaParse/issues/1070",
            "+1.5E-03, as instruments write it, is no number",
            files.flow_curve(*(f"{rate:+.6E},{12 + 1.5 * rate:+.6E}" for rate in files.RATES)),
            PASTE,
            (TWELVE, refused("curve.csv", "line 2|row 2")),
        ),
    ),
    "robots": (
        Report(
            "Makeblock-official/mDrawBot/issues/31",
            "x and y are exchanged, and what is drawn is mirrored",
            files.robot_cell(files.SWAPPED, files.SAMPLE_CORNERS),
            ROBOT,
            (refused("cell.toml", "mirror|robot_z|underside|from below|exchanged|swapped"),),
        ),
        Report(
            "opencv/opencv/issues/24871",
            "poses that hardly differ in rotation make a calibration worthless",
            files.robot_cell(files.ALMOST_ONE_LINE, files.NEARLY_IN_LINE),
            ROBOT,
            (refused("cell.toml", "line|spread|narrow|apart"), warned("in line|one line|spread|narrow")),
        ),
        Report(
            "teachingtechYT/teachingtechYT.github.io/pull/39",
            "a feed is written in mm/s where the firmware takes mm/min",
            files.robot_cell(files.CORNERS, files.SAMPLE_CORNERS),
            f"{ROBOT} --format gcode",
            (feed_is_of_the_path,),
        ),
        Report(
            "MIT-LCP/mimic.mit.edu/pull/36",
            "a rate per minute stands where one per hour is meant",
            files.robot_cell(files.CORNERS, files.SAMPLE_CORNERS, files.MINUTES),
            ROBOT,
            (refused("pump.csv"), warned("pump.csv", "times")),
        ),
        Report(
            "NUbots/NUbots/pull/435",
            "degrees are passed on as radians",
            files.robot_cell(files.CORNERS, files.SAMPLE_CORNERS),
            f"{ROBOT} --format urscript",
            (poses_are_metres_and_radians,),
        ),
    ),
}

"""The first forty, of all kinds."""

LENGTH_RIGHT = right(LENGTH, files.CRACK_MM, 1.5)
DEPTHS = f"digitise photo.png --ends 40,150 460,160 --depth-mm depths.csv --mm-per-px 0.1 {TO}"

LATER_REPORTS = {
    "photos": (
        Report(
            "haraldk/TwelveMonkeys/issues/184",
            "a TIFF whose colours lie in planes is taken for one with interleaved colours",
            files.planar_tiff,
            f"digitise photo.tif {CLICKED}",
            (LENGTH_RIGHT, refused("photo.tif", "planar|plane")),
        ),
        Report(
            "image-rs/image-tiff/issues/400",
            "a tiled TIFF whose width is not a multiple of the tiles' has black columns",
            files.tiled_tiff,
            f"digitise photo.tif {CLICKED}",
            (LENGTH_RIGHT, refused("photo.tif", "tile")),
        ),
        Report(
            "darktable-org/darktable/pull/18815",
            "a grey TIFF whose 0 is white is read inverted",
            files.mask_of_white_zero,
            f"digitise photo.png --mask mask.tif {SCALED}",
            (right(WIDTH, 2.1, 0.2), refused("mask.tif", "white|inverted")),
        ),
        Report(
            "pnggroup/libpng/issues/853",
            "an interlaced PNG of 16 bits, brought to 8, has wrong values in half of its pixels",
            files.interlaced_of_16_bits,
            f"digitise photo.png {CLICKED}",
            (LENGTH_RIGHT, refused("photo.png", "16|interlac|more than 8 bits")),
        ),
        Report(
            "michaelrsweet/pappl/issues/267",
            "a grey PNG of few bits is all black",
            files.mask_of_2_bits,
            f"digitise photo.png --mask mask.png {SCALED}",
            (right(WIDTH, 2.1, 0.2), refused("mask.png", "bit")),
        ),
        Report(
            "sumatrapdfreader/sumatrapdf/issues/1544",
            "the orientation that a WebP states is ignored",
            files.turned_webp,
            f"digitise photo.webp {CLICKED}",
            (LENGTH_RIGHT, refused("photo.webp", "webp|orientation")),
        ),
        Report(
            "openMVG/openMVG/issues/217",
            "the size in the EXIF is not that of the picture, which was made smaller",
            files.size_of_before,
            f"digitise photo.jpg {CLICKED}",
            (LENGTH_RIGHT, refused("photo.jpg", "exif|size")),
        ),
        Report(
            "haraldk/TwelveMonkeys/issues/147",
            "a JPEG in CMYK by Adobe is read inverted",
            files.cmyk_by_adobe,
            f"digitise photo.jpg {CLICKED}",
            (LENGTH_RIGHT, refused("photo.jpg", "cmyk")),
        ),
        Report(
            "RodDalBen/SHINE_color/issues/11",
            "what is transparent in a PNG becomes as coloured as the rest",
            files.mask_by_transparency,
            f"digitise photo.png --mask mask.png {SCALED}",
            (right(WIDTH, 2.1, 0.2), refused("mask.png", "transparen|alpha|white|whole|all of")),
        ),
    ),
    "tables": (
        Report(
            "numpy/numpy/issues/10448",
            "a table in descending order is interpolated wrongly, without a word",
            files.photo_and_depths("44,6", "10,12", "0,12"),
            DEPTHS,
            (mean_depth_is((10 * 12 + 34 * 9) / 44), refused("depth", "station 10", "increasing")),
        ),
        Report(
            "equinor/ert/pull/37",
            "two rows of one time with different values: one is taken, without a warning",
            files.photo_and_depths("0,10", "22,10", "22,4", "44,10"),
            DEPTHS,
            (refused("depth", "22"), warned("depth", "22")),
        ),
        Report(
            "opensim-org/opensim-core/issues/2536",
            "a table with two rows of one time is read, and one of them holds",
            files.aged_material("0,1,5", "10,2,8", "10,4,20", "20,8,40"),
            f"run trial.toml --device cpu {TO}",
            (refused("material.csv", "row 4|line 4"),),
        ),
        Report(
            "jdriver06/CoreFloodManager/issues/7",
            "one more scan over the shear rates comes with the import of a rheometer's table",
            files.flow_curve(*files.TWICE_UP),
            PASTE,
            (
                refused("curve.csv", "sweep|twice|branch|hystere|thixotrop|loop|scan|repeat"),
                warned("sweep|twice|branch|hystere|thixotrop|loop|scan"),
                interval_holds(12, 20),
            ),
        ),
        Report(
            "whoenig/uav_trajectories/issues/1",
            "a path that stands still for a while stops the program",
            files.path_with_a_pause,
            f"digitise trial.toml {TO}",
            (pause_is_kept, refused("plan.csv", "row|line")),
        ),
    ),
    "sheets": (
        Report(
            "Deltares/ddlpy/issues/24",
            "of several values of one place all but one are dropped, without a word",
            files.text("a.csv", "s_mm,level_mm", "5,-2.0", "10,-2.1", "15,-2.2", "15,-2.6", "10,-2.5", "5,-2.4"),
            'st.read_readings("a.csv").level_mm',
            (has_levels((-2.0, -2.1, -2.2, -2.6, -2.5, -2.4), (-2.2, -2.3, -2.4)), refused("a.csv", "line|row")),
        ),
        Report(
            "vizabi/vizabi/issues/2547",
            "decimal commas and decimal points in one file, separated by semicolons: some numbers are texts",
            files.text("a.csv", "s_mm;level_mm", "5,5;-2,15", "10.5;-2.25", "15,5;-2,05"),
            'st.read_readings("a.csv").level_mm',
            (has_levels((-2.15, -2.25, -2.05)), refused("a.csv", "line|row")),
        ),
    ),
    "meshes": (
        Report(
            "openscad/openscad/issues/945",
            "triangles without area, on an edge that is cut in two, make a sound solid unreadable",
            files.stl_with_flat_triangles,
            f"import-mesh block.stl --units mm {TO}",
            (SLOT, refused("block.stl", "area|degenerate|flat")),
        ),
    ),
    "drawings": (
        Report(
            "LibreCAD/LibreCAD/issues/2491",
            "arcs of a block that is inserted mirrored bend the other way",
            files.dxf_mirrored_block,
            f"import-dxf a.dxf --outline OUTLINE --depth-mm 10 {TO}",
            (right(MM3, files.BULGED_MM3, 24), refused("a.dxf", "mirror|block|insert")),
        ),
        Report(
            "haplokuon/netDxf/issues/184",
            "where two boundaries lie upon each other nothing is filled",
            files.dxf_drawn_twice,
            f"import-dxf a.dxf --outline OUTLINE --depth-mm 10 {TO}",
            (right(MM3, 2400, 24), refused("a.dxf", "twice|two|2 |several|copy|same|overlap")),
        ),
    ),
    "robots": (
        Report(
            "robotology-legacy/wysiwyd/pull/70",
            "that a calibration by more than three points failed is not noticed",
            files.robot_cell(files.ONE_TOO_HIGH, files.FOUR_CORNERS),
            ROBOT,
            (refused("cell.toml", "taught|frame_limit|mm"),),
        ),
    ),
}
"""Drawn after the two faults that the first forty showed were mended, of the kinds where those lay and near them."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", metavar="KIND|WORD", help="kinds, or parts of addresses")
    asked = parser.parse_args()
    rows = []
    for kind, reports in (*REPORTS.items(), *LATER_REPORTS.items()):
        for report in reports:
            if asked.only is None or any(word == kind or word in report.address for word in asked.only):
                line, sound = judge(report)
                print(f"{'sound' if sound else 'WRONG':<6}{kind} {report.address}: {line}", flush=True)
                rows.append(Row(report.address, float(sound), "", 1, 1))
    leave(rows)


def judge(report: Report) -> tuple[str, bool]:
    """Return the exit code and the last words of the answer, and whether it is sound."""
    with tempfile.TemporaryDirectory() as scratch:
        given, out = Path(scratch) / "given", Path(scratch) / "out"
        given.mkdir()
        out.mkdir()
        report.make(given)
        ended = run_in(given, out, report.command)
        if ended is None:
            return f"not done in {LIMIT_S} s", False
        printed = f"{ended.stdout}\n{ended.stderr}"
        answer = Ended(ended.returncode, " ".join(printed.lower().split()), ended.stdout, out)
        sound = "Traceback" not in printed and any(check(answer) for check in report.sound)
    return f"exit {ended.returncode}: {last_words(ended)}", sound


if __name__ == "__main__":
    main()
