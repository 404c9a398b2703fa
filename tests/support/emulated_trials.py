"""Two tiny trials whose readings are EMULATED by a run of a known paste, to calibrate on one and predict the other."""

from pathlib import Path

import numpy as np

from sealtwin.calibration.search import Twin
from sealtwin.core.progress import Progress
from sealtwin.core.records import Floats
from tests.support.tiny_study import HERE, tiny_lab

TRUTH = {"fluid.viscosity_pa_s": 0.1, "fluid.yield_stress_pa": 2.0}
# Paste that does not freeze keeps its volume, even of so few particles.
PASTE = {
    "U = 30.0\nD_cm = 0.3": "viscosity_pa_s = 0.1\nyield_stress_pa = 1.0",
    "freeze_after_s = 0.2": 'freeze_after_s = "never"',
    "substeps = 2": "substeps = 3\nsettle_s = 0.6",
    "volume_ml = 0.08": "volume_ml = 0.12",
}
STATIONS_MM = np.arange(1.0, 11.5, 0.5)
ERROR_MM = 0.3  # Large, since an emulator of a dozen tiny runs is off by as much


def tiny_trials(lab: Path) -> tuple[Path, Path]:
    """Write trial.toml, which is calibrated on, and other.toml, which is held out; return both."""
    tiny_lab(lab)
    one, other = lab / "trial.toml", lab / "other.toml"
    text = one.read_text(encoding="utf-8")
    for old, new in PASTE.items():
        text = text.replace(old, new)
    one.write_text(text, encoding="utf-8")
    held_out = {'name = "tiny"': 'name = "other"', "calibrated-on": "held-out", "readings.csv": "others.csv"}
    for old, new in {**held_out, "volume_ml = 0.12": "volume_ml = 0.1"}.items():
        text = text.replace(old, new)
    other.write_text(text, encoding="utf-8")
    for number, (trial, sheet) in enumerate(((one, "readings.csv"), (other, "others.csv"))):
        write_readings(lab / sheet, np.zeros(len(STATIONS_MM)), number)
        (level_mm,) = Twin(trial, lab / "truth", HERE, Progress()).run([(TRUTH, 900 + number)])
        assert level_mm is not None
        write_readings(lab / sheet, level_mm, number)
    return one, other


def write_readings(path: Path, level_mm: Floats, seed: int) -> None:
    """Write three repeats of each station, each with an error of its own."""
    errors_mm = ERROR_MM * np.random.default_rng(seed).standard_normal((3, len(STATIONS_MM)))
    columns = np.column_stack([STATIONS_MM, *(level_mm + errors_mm)])
    np.savetxt(path, columns, "%.2f", ",", header="s_mm,level_1_mm,level_2_mm,level_3_mm", comments="")
