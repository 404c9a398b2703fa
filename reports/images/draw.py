"""The README's picture, from a finished run folder: the traced face, the fill, its level beside the readings.

python reports/images/draw.py reports/paper-trial
"""

import sys
from pathlib import Path

import matplotlib.image
from matplotlib.figure import Figure

from sealtwin.core import record_files
from sealtwin.trial.trial_file import load_trial
from validate.compare import compare
from validate.figures.levels import draw_profile
from validate.figures.solid_pictures import draw_side_view
from validate.figures.theme import themed
from validate.readings.read_readings import read_readings

TARGET = Path(__file__).parent / "paper-trial.png"


def main(folder: Path) -> None:
    trial = load_trial(folder / "trial.toml")
    if trial.readings is None:
        raise SystemExit(f"{folder}: a trial without readings has no level to draw beside the simulation")
    outline, solid = record_files.read_outline(folder), record_files.read_solid(folder)
    run, profile = record_files.read_run(folder), record_files.read_profile(folder)
    readings = read_readings(folder / trial.readings.file, trial.readings, outline.length_mm, solid.depth_mm)
    comparison = compare(
        profile, readings, outline, solid, gate=trial.gate, role=trial.readings.role, photo_data=trial.photo.data
    )
    with themed():
        figure = Figure(figsize=(8.0, 10.2), layout="constrained")
        face, side, level = figure.subfigures(3, 1, height_ratios=(1.25, 1.0, 1.25))
        axes = face.add_subplot()
        axes.imshow(matplotlib.image.imread(folder / "overlay.png"))
        axes.set_axis_off()
        axes.set_title(f"{trial.name}: photo {trial.photo.data}, readings {readings.data}")
        draw_side_view(run, outline, solid, profile, on=side)
        draw_profile(profile, solid.sections, readings, comparison, on=level)
        figure.savefig(TARGET, dpi=110, metadata={"Software": None})
    print(TARGET)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
