"""The shipped trial between other walls, nothing refitted: what its readings hold of 4.8 ml, and its mean error.

    python -m benchmarks.paper_walls

The paper does not say which wall it tilts by how much, and nobody measured walls. The readings hold the 4.8 ml that
were dispensed if each wall opens by about 5 degrees, or one wall by 11; between parallel walls they hold a third less.
The last row dispenses only what they hold between upright walls. The fluid is the same in all rows.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.paper_trial import FIXTURE
from benchmarks.table import Row, leave, run_benchmark
from sealtwin.core import record_files
from sealtwin.core.progress import PlainProgress
from sealtwin.core.run_folder import open_folder
from sealtwin.core.settings import checked
from sealtwin.trial.job import STAGES, start_job
from sealtwin.trial.pipeline import run_stages
from sealtwin.trial.trial_file import Trial, load_trial, with_settings

WALLS: dict[str, dict[str, Any]] = {
    "flare 5.5, as shipped": {},
    "one wall at 11, one upright": {"crack.wall_angle_deg": [11.0, 0.0]},
    "undercut 4.84": {"crack.tilt": "undercut", "crack.wall_angle_deg": 4.84},
    "upright": {"crack.tilt": "vertical", "crack.wall_angle_deg": 0.0},
    "lean 11": {"crack.tilt": "lean", "crack.wall_angle_deg": 11.0},
}
"""Settings of the crack by the name of its walls."""


@dataclass(frozen=True)
class Seen:
    mouth_mm: float
    floor_mm: float
    cavity_ml: float
    readings_ml: float
    dispensed_ml: float
    error_mm: float
    escaped: int
    volume_ratio: float

    @property
    def cells(self) -> str:
        missing = 100 * (1 - self.readings_ml / self.dispensed_ml)
        widths = f"{self.mouth_mm:.1f} / {self.floor_mm:.1f}"
        volumes = f"{self.cavity_ml:.2f} | {self.dispensed_ml:.2f} | {self.readings_ml:.2f} | {round(missing)} %"
        return f"{widths} | {volumes} | {self.volume_ratio:.2f} | {self.error_mm:.2f}"


def main() -> list[Row]:
    rows = []
    print(
        "| walls | mouth / floor, mm | cavity, ml | dispensed, ml | readings hold, ml | not found | volume kept "
        "| mean error, mm |"
    )
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as place:
        beds = {name: _seen(settings, Path(place, name)) for name, settings in WALLS.items()}
        poured = {"path.volume_ml": round(beds["upright"].readings_ml, 2)}
        beds["upright, as much as the readings hold"] = _seen(WALLS["upright"] | poured, Path(place, "less"))
    for name, bed in beds.items():
        print(f"| {name} | {bed.cells} |")
        rows += [
            Row(f"{name}: mean error", bed.error_mm, "mm"),
            Row(f"{name}: readings hold", bed.readings_ml, "ml"),
            Row(f"{name}: escaped particles", bed.escaped, "", 0, 0),
            Row(f"{name}: volume ratio", bed.volume_ratio, "", 0.95, 1.05),
        ]
    return rows


def _seen(settings: dict[str, Any], place: Path) -> Seen:
    content = load_trial(FIXTURE / "trial.toml").model_dump(mode="json", exclude_none=True)
    trial = checked(Trial, FIXTURE / "trial.toml", with_settings(content, {**settings, "output.snapshots_s": []}))
    with open_folder(place, create=True) as folder, PlainProgress() as progress:
        result = run_stages(start_job(trial, FIXTURE, folder, "cpu", progress), STAGES).result
    figures, sample, fluid, comparison = (
        record_files.read_solid(place).figures,
        result.sample,
        result.fluid,
        result.comparison,
    )
    assert sample is not None
    assert fluid is not None
    assert comparison is not None
    return Seen(
        figures.mouth_width_mm or 0.0,
        figures.floor_width_mm or 0.0,
        (sample.cavity_volume_mm3 or 0.0) / 1e3,
        comparison.measured_sealant_mm3 / 1e3,
        sample.sealant_mm3 / 1e3,
        comparison.mean_error_mm,
        fluid.escaped_particles or 0,
        fluid.volume_ratio,
    )


if __name__ == "__main__":
    run_benchmark(main, leave)
