"""What the paper's readings say of its U and D: posterior.md and its figure, beside the pair that the paper chose.

    python -m reports.reproduction.posterior [--jobs 2]

Twice forty runs of the trial of the study of all pairs, walls flared, particles of 0.6 mm: with U and D free alone, and
with the two settings that this repository chose on the same readings. The readings are RECONSTRUCTED from the paper's
prose, which leaves them open by 3 mm along the crack and 0.5 mm in level, and the first 20 mm altogether. Killed, the
same command goes on.
"""

import argparse
import shutil
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from matplotlib.figure import Figure

import sealtwin
from reports.reproduction.redrawn import ALONG_MM, LEVEL_MM
from reports.reproduction.surface import CHOSEN
from sealtwin.api.trials import CalibrationResult
from sealtwin.core import files
from sealtwin.core.records import Floats
from sealtwin.core.settings import checked
from sealtwin.study.study_file import load_study
from sealtwin.trial.trial_file import Trial, load_trial, trial_text, with_settings
from validate.figures import theme
from validate.figures.drawing import NO_METADATA

HOME = Path(__file__).resolve().parent
STUDY = HOME.parents[1] / "fixtures" / "paper-trial" / "study-paper.toml"
WORK = HOME.parent / "paper-posterior"
PAIR = ("fluid.U", "fluid.D_cm")
CHOSEN_HERE = {"fluid.freeze_after_s": (1.0, 6.0), "crack.wall_angle_deg": (2.5, 8.5)}
"""Settings that the paper does not give as numbers of a material or a crack, with ranges around what was chosen."""
FIGURE = "figures/posterior.svg"
TOLD_FROM_MM = 20.0  # Nearer to the start the line hangs on a first reading that the paper does not give
NEAR = 3.5  # Factor of U and of D, a step of the study of all pairs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=None)
    jobs = parser.parse_args().jobs
    grid = load_study(STUDY).grid
    assert grid is not None, "the study of all pairs is one"
    pair = {name: (float(min(grid[name])), float(max(grid[name]))) for name in PAIR}
    trial = write_trial()
    how = {"jobs": jobs, "progress": True}
    alone = sealtwin.calibrate(trial, pair, out=WORK / "pair", **how)
    more = sealtwin.calibrate(trial, pair | CHOSEN_HERE, out=WORK / "more", **how)
    near = None
    if more.posterior:
        pairs = np.column_stack([more.posterior[name] for name in PAIR])
        near = float(np.mean(np.abs(np.log(pairs / CHOSEN)).max(axis=1) <= np.log(NEAR)))
        with theme.themed():
            draw_posterior(pairs, pair).savefig(HOME / FIGURE, metadata=NO_METADATA)
    files.write_text(HOME / "posterior.md", page_of(alone, more, near))
    print(HOME / "posterior.md")


def write_trial() -> Path:
    """Write the trial of the study of all pairs, with the readings that prose tells and how far it leaves them open."""
    study = load_study(STUDY)
    source = STUDY.parent / study.trial
    content = load_trial(source).model_dump(mode="json", exclude_none=True)
    content["name"] = "paper-pair"
    content["readings"]["fitted"] = [name for name in content["readings"]["fitted"] if name not in study.fixed]
    # What was chosen on these very readings is not measured.
    del content["uncertainty"]["wall_angle_deg"]
    content["uncertainty"] |= {"station_mm": ALONG_MM, "common_mm": LEVEL_MM}
    trial = checked(Trial, STUDY, with_settings(content, study.fixed))
    WORK.mkdir(exist_ok=True)
    shutil.copy(source.parent / "photo.jpg", WORK / "photo.jpg")
    header, *rows = (source.parent / "caliper.csv").read_text(encoding="utf-8").splitlines()
    stations = [row for row in rows if float(row.partition(",")[0]) >= TOLD_FROM_MM]
    files.write_text(WORK / "caliper.csv", "\n".join([header, *stations, ""]))
    files.write_text(WORK / "trial.toml", trial_text(trial))
    return WORK / "trial.toml"


def page_of(alone: CalibrationResult, more: CalibrationResult, near: float | None) -> str:
    """Return the page; ``near`` is the share of the posterior within a step of the pair that the paper chose."""
    page = Environment(loader=FileSystemLoader(HOME), undefined=StrictUndefined, trim_blocks=True, autoescape=False)
    open_by = {"along_mm": ALONG_MM, "level_mm": LEVEL_MM, "from_mm": TOLD_FROM_MM}
    content = {"alone": alone.content, "more": more.content, "near": near, **open_by}
    return page.get_template("posterior.md.j2").render(**content, figure=FIGURE, chosen=CHOSEN, factor=NEAR)


@theme.themed()
def draw_posterior(pairs: Floats, ranges: dict[str, tuple[float, float]]) -> Figure:
    """Draw draws of U and D, (n, 2), over the range of both, and the pair that the paper chose."""
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.plot(*pairs.T, linestyle="none", marker="o", markersize=3, alpha=0.4, color=theme.SIMULATED, label="posterior")
    marked = {"linestyle": "none", "marker": "D", "markersize": 8, "color": theme.MEASURED}
    axes.plot(*([value] for value in CHOSEN), **marked, label="chosen by the paper")
    axes.set(xscale="log", yscale="log", xlim=ranges[PAIR[0]], ylim=ranges[PAIR[1]])
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
    theme.label_axes(axes, "U", "D (cm)", "U and D by the RECONSTRUCTED readings")
    axes.legend(loc="best")
    return figure


if __name__ == "__main__":
    main()
