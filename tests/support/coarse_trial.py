"""The fixture's trial made coarse and quick, for tests of how a run goes and not of what it finds."""

import shutil
from pathlib import Path

from tests.support.paths import FIXTURE

QUICKER = (
    ("radius_mm = 0.4", "radius_mm = 0.75"),
    ("speed_mm_s = 4.0", "speed_mm_s = 20.0"),
    ("diameter_mm = 2.4", "diameter_mm = 4.6"),
    ("freeze_after_s = 2.58", "freeze_after_s = 0.5"),
    ("settle_s = 2.0", "settle_s = 0.0"),
    ("mean_error_mm = 1.6", "mean_error_mm = 20.0"),
)
NO_PICTURES = """
[output]
snapshots_s = []
"""


def make_coarse(lab: Path) -> Path:
    """Copy the fixture to ``lab`` and coarsen its trial; returns the trial file."""
    shutil.copytree(FIXTURE, lab)
    trial = lab / "trial.toml"
    text = trial.read_text(encoding="utf-8")
    for old, new in QUICKER:
        assert old in text
        text = text.replace(old, new)
    trial.write_text(text + NO_PICTURES, encoding="utf-8")
    return trial
