"""The README's picture, Figure 1 of the report of a finished run folder, and that report as PDF.

python reports/images/draw.py reports/paper-trial
"""

import sys
from pathlib import Path

import cv2
import numpy as np
from pypdf import PdfWriter

from sealtwin.core import record_files
from sealtwin.trial.trial_file import load_trial
from validate.figures.first_figure import FirstFigure
from validate.readings.read_readings import read_readings
from validate.result import Comparison

TARGET = Path(__file__).parent / "paper-trial.png"


def main(folder: Path) -> None:
    trial = load_trial(folder / "trial.toml")
    if trial.readings is None:
        raise SystemExit(f"{folder}: a trial without readings has no level to draw beside the simulation")
    outline, solid = record_files.read_outline(folder), record_files.read_solid(folder)
    straight = cv2.imread(str(folder / "straight.png"), cv2.IMREAD_COLOR_RGB)
    figure = FirstFigure(
        outline=outline,
        solid=solid,
        trajectory=record_files.read_trajectory(folder),
        profile=record_files.read_profile(folder),
        straight=np.asarray(straight, dtype=np.uint8),
        readings=read_readings(folder / trial.readings.file, trial.readings, outline.length_mm, solid.depth_mm),
        comparison=Comparison.model_validate_json((folder / "comparison.json").read_text(encoding="utf-8")),
    ).draw()
    figure.savefig(TARGET, dpi=110, metadata={"Software": None})
    report = PdfWriter(clone_from=folder / "report.pdf")
    for page in report.pages:
        for image in page.images:
            # Figures as JPEG, so that the file stays below 600 kB.
            image.replace(image.image, quality=85)
    report.write(TARGET.with_suffix(".pdf"))
    print(TARGET, TARGET.with_suffix(".pdf"))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
