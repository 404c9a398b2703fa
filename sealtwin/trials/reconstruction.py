"""The paper's trial, reconstructed from its prose: no photo and no reading of it was ever published.

The paper ("Position-based fluid simulation for robotic injection sealing of pavement cracks") describes one sample and
one measured profile in words. What this module writes follows those words, is deterministic, and is called a
reconstruction wherever it is shown.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from sealtwin.errors import InputError
from sealtwin.records import Floats
from sealtwin.store.files import write_if_new, write_text
from sealtwin.store.folder import require_folder
from sealtwin.store.tables import write_table

SEED = 1
"""Of the photo and of the readings."""
DESCRIBED_MM = ((0.0, -16.0), (20.0, -4.0), (30.0, -4.0), (40.0, 1.0), (80.0, 1.0))
"""Station and level: underfilled at the start, a plateau from 20 to 30 mm, overspill about 1 mm high from 40 mm."""
STATION_MM = 5.0
REPEATS = 3
SCATTER_MM = 0.15
"""Standard deviation of one reading: a caliper set down by hand on a rough, cured paste."""
CALIPER_COLUMNS = ("s_mm", "level_1_mm", "level_2_mm", "level_3_mm")


FLARED = {
    "name": "paper-trial",
    "tilt": "flare",
    "wall_angle_deg": "5.5",
    "preset": "accurate",
    "mean_error_mm": "1.6",
    "stiffens": """\
# What holds the slope of the bed, in place of the paper's freezing by age; read off these very readings.
freeze_after_s = "never"
yield_stress_pa = 12.0""",
    "settles": """
settle_s = 2.0                  # what the nozzle left last has come to rest by then""",
    "declared": """
# How well a lab may know what it sets and measures, one standard deviation each, as we judge. Not viscosity and yield
# stress: nobody measured them, they were read off these very readings.
[uncertainty]
speed_mm_s = 0.1                # a small arm along a bend, which nobody measured
volume_ml = 0.1                 # a syringe of 10 ml, read to half of its division of 0.2 ml
start_mm = 1.0                  # the nozzle is taught to the crack's end by eye
width_mm = 0.1                  # one pixel of the photo: where grey turns into crack
wall_angle_deg = 1.0            # seen by nobody; at 5.5 degrees the crack holds 5.95 ml, 0.36 ml less a degree lower
depth_mm = 0.5                  # a ruler's reading, averaged over a broken floor
station_mm = 1.0                # the caliper is set to its station by hand
""",
    "why": """\
# Walls flare by 5.5 degrees and the fluid keeps its volume: of all readings of the paper's geometry, the one that then
# holds its 4.8 ml. The paste has a yield stress.""",
}
LEANING = {
    "name": "paper-trial-lean",
    "tilt": "lean",
    "wall_angle_deg": "11.0",
    "preset": "paper",
    "mean_error_mm": "1.8",
    "stiffens": "freeze_after_s = 2.58",
    "settles": "",
    "declared": "",
    "why": """\
# Both walls lean by 11 degrees, and the fluid has the constants of the solver that the paper built on, its freezing
# too: a crack too small for 4.8 ml, and a fluid that loses a fifth of its volume. Never mix this with trial.toml.""",
}
TRIAL = """\
# The paper's trial, RECONSTRUCTED: a procedural photo, and readings drawn from the paper's prose; nothing was measured.
{why}

name = "{name}"
note = "The paper's trial, reconstructed: procedural photo, readings from the paper's prose; nothing was measured."
seed = 0

[photo]
file = "photo.jpg"
data = "synthetic"
face_mm = [160.0, 40.0]
ends_px = {ends_px}

[photo.markers]
dictionary = "{dictionary}"
size_mm = {size_mm}
markers = [
{markers}
]

[crack]
depth_mm = 16.0
tilt = "{tilt}"
wall_angle_deg = {wall_angle_deg}

[path]
volume_ml = 4.8
trim_mm = 10.0
speed_mm_s = 4.0

[fluid]
U = 30.0
D_cm = 0.3
{stiffens}

[solver]
preset = "{preset}"
radius_mm = 0.4{settles}

[nozzle]
diameter_mm = 2.4

[readings]
file = "caliper.csv"
data = "reconstructed"
role = "calibrated-on"

[gate]
mean_error_mm = {mean_error_mm}
{declared}"""


def write_paper_trial(folder: Path) -> None:
    """Write the reconstructed trial into ``folder``: photo, its truth, readings, and both readings of the geometry."""
    from digitise.specimens.specimen import make_specimen

    specimen = make_specimen(SEED)
    specimen.write(folder)
    write_table(folder / "caliper.csv", CALIPER_COLUMNS, paper_readings(SEED), decimals=2)
    board = specimen.board
    photo = {
        "ends_px": [[round(x, 1), round(y, 1)] for x, y in specimen.ends_px],
        "dictionary": board.dictionary,
        "size_mm": board.size_mm,
        "markers": "\n".join(
            f"  {{ id = {marker.id}, x_mm = {marker.x_mm}, y_mm = {marker.y_mm} }}," for marker in board.markers
        ),
    }
    write_text(folder / "trial.toml", TRIAL.format(**photo, **FLARED))
    write_text(folder / "trial-paper.toml", TRIAL.format(**photo, **LEANING))


def place_paper_trial(folder: Path) -> None:
    """``write_paper_trial`` into a folder that may be there already.

    Raises InputError where it holds anything else: nothing of the user's is overwritten.
    """
    require_folder(folder)
    with TemporaryDirectory() as fresh:
        write_paper_trial(Path(fresh))
        for path in Path(fresh).iterdir():
            target = folder / path.name
            if target.exists() and (not target.is_file() or target.read_bytes() != path.read_bytes()):
                raise InputError(f"{target}: is there already and is not the demo's; give --out another folder.")
        for path in Path(fresh).iterdir():
            write_if_new(folder / path.name, path.read_bytes())


def paper_readings(seed: int) -> Floats:
    """Station and repeated levels relative to the face, upward, in mm: (17, 1 + REPEATS)."""
    described = np.array(DESCRIBED_MM)
    s_mm = np.arange(0, described[-1, 0] + STATION_MM / 2, STATION_MM)
    level_mm = np.interp(s_mm, described[:, 0], described[:, 1])
    scatter_mm = np.random.default_rng([seed, 3]).normal(0, SCATTER_MM, (len(s_mm), REPEATS))
    return np.column_stack([s_mm, np.round(level_mm[:, None] + scatter_mm, 2)])


if __name__ == "__main__":
    write_paper_trial(Path(sys.argv[1]))
