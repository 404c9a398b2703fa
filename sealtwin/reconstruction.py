"""The paper's trial, reconstructed from its prose: no photo and no reading of it was ever published.

The paper ("Position-based fluid simulation for robotic injection sealing of pavement cracks") describes one sample and
one measured profile in words. What this module writes follows those words, is deterministic, and is called a
reconstruction wherever it is shown.
"""

from pathlib import Path

import numpy as np

from sealtwin.files import write_table
from sealtwin.records import Floats

SEED = 1
"""Of the photo and of the readings."""
DESCRIBED_MM = ((0.0, -16.0), (20.0, -4.0), (30.0, -4.0), (40.0, 1.0), (80.0, 1.0))
"""Station and level: underfilled at the start, a plateau at -4 mm from 20 to 30 mm, overspill about 1 mm high from 40."""
STATION_MM = 5.0
REPEATS = 3
SCATTER_MM = 0.15
"""Standard deviation of one reading: a caliper's probe set down on sand by hand."""
CALIPER_COLUMNS = ("s_mm", "level_1_mm", "level_2_mm", "level_3_mm")


def write_paper_trial(folder: Path) -> None:
    """Write photo.jpg, truth.json and caliper.csv of the reconstructed trial into ``folder``."""
    from digitise.specimen import make_specimen

    make_specimen(SEED).write(folder)
    write_table(folder / "caliper.csv", CALIPER_COLUMNS, paper_readings(SEED), decimals=2)


def paper_readings(seed: int) -> Floats:
    """Station and repeated levels relative to the face, upward, in mm: (17, 1 + REPEATS)."""
    described = np.array(DESCRIBED_MM)
    s_mm = np.arange(0, described[-1, 0] + STATION_MM / 2, STATION_MM)
    level_mm = np.interp(s_mm, described[:, 0], described[:, 1])
    scatter_mm = np.random.default_rng([seed, 3]).normal(0, SCATTER_MM, (len(s_mm), REPEATS))
    return np.column_stack([s_mm, np.round(level_mm[:, None] + scatter_mm, 2)])
