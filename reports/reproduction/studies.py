"""The paper reproduced: its study for both readings of the tilt, its claims held against ours, a page."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from reports.reproduction.claims import Finding, findings
from reports.reproduction.redrawn import errors_against, redraw
from reports.reproduction.surface import CHOSEN, surface_of, surfaces_of
from reports.reproduction.telling import FIGURES, Feeding, Study, page
from reports.reproduction.unequal import by_sampling, of_all
from sealtwin.core import files
from sealtwin.core.cluster import cores
from sealtwin.core.files import write_sheet
from sealtwin.core.progress import Progress
from sealtwin.study.study_file import load_study
from sealtwin.study.study_folder import StudyRun, read_plan
from sealtwin.study.study_map import Mapped, map_study
from sealtwin.study.sweep import SweepOptions, sweep


@dataclass(frozen=True)
class Part:
    """A study of the reproduction, before it is run."""

    name: str
    title: str
    study: Path
    fine: Path | None
    """The pairs that the paper names with particles of its size, where those of the study are coarser."""
    fills: bool
    """Whether some of its runs are drawn as they fill the crack."""


def parts(home: Path) -> tuple[Part, ...]:
    """``home`` is reports/reproduction in a checkout."""
    fixture = home.parents[1] / "fixtures" / "paper-trial"
    return (
        Part(
            "flare",
            "walls flared, preset accurate",
            fixture / "study-paper.toml",
            home / "study-flare-fine.toml",
            fills=True,
        ),
        Part(
            "lean",
            "walls leaning, preset paper",
            home / "study-lean.toml",
            fine=None,
            fills=False,
        ),
    )


def reproduce(home: Path, wanted: tuple[Part, ...], work: Path, progress: Progress) -> list[str]:
    """Run the studies into ``work``, write README.md and figures/ into ``home``; the lines to say at the end."""
    maps, studies = [], []
    for part in wanted:
        folder = _swept(part.study, work, progress)
        maps.append(map_study(folder, None, None, None, "cpu" if part.fills else None, progress))
        fine = [] if part.fine is None else read_plan(_swept(part.fine, work, progress)).runs
        studies.append(_study(home, part, maps[-1], fine))
    chart = maps[0].chart
    chosen = next(run for run in chart.runs if run.at == CHOSEN)
    progress.note("Feeding similaritymeasures unequal samplings.")
    feeding = Feeding(chart, by_sampling(chosen, chart.readings), chosen.mean_error_mm, of_all(chart))
    files.write_text(home / "README.md", page(studies, feeding))
    _write_claims(home / "figures" / "claims.csv", studies)
    write_sheet(
        home / "figures" / "unequal-samplings.csv",
        ("points", "mean_error_mm"),
        [(each.points, each.error_mm) for each in feeding.samplings],
    )
    return [*(mapped.sheet.finding for mapped in maps), f"Page: {home / 'README.md'}"]


def _swept(study: Path, work: Path, progress: Progress) -> Path:
    """The folder in which all runs of a study are done, or failed for a reason."""
    folder = work / load_study(study).folder_name
    states = sweep(study, folder, SweepOptions(device="cpu", jobs=cores()), progress)["states"]
    progress.note(f"{folder}: {states['done']} runs done, {states['failed']} failed.")
    return folder


def _study(home: Path, part: Part, mapped: Mapped, fine: Sequence[StudyRun]) -> Study:
    chart = mapped.chart
    redrawn = redraw()
    found = findings(surface_of(chart), surfaces_of(chart, errors_against(chart, redrawn), redrawn))
    drawn = mapped.folder / "figures"
    shown = [name for name, _ in FIGURES if (drawn / f"{name}.svg").is_file()]
    (home / "figures").mkdir(parents=True, exist_ok=True)
    for name in [*(f"{name}.svg" for name in shown), "runs.csv"]:
        shutil.copyfile(drawn / name, home / "figures" / f"{part.name}-{name}")
    finer_mm = {
        (float(run.settings["fluid.U"]), float(run.settings["fluid.D_cm"])): run.figures["mean_error_mm"]
        for run in fine
        if run.figures
    }
    radius_mm = float(load_study(part.study).fixed["solver.radius_mm"])
    return Study(part.name, part.title, radius_mm, chart, found, finer_mm, shown)


def _write_claims(path: Path, studies: list[Study]) -> None:
    def cells(study: Study, finding: Finding) -> tuple[str, ...]:
        return study.title, finding.name, finding.paper, finding.ours, finding.redrawn, finding.judgement

    columns = ("study", "claim", "paper", "ours", "redrawn", "judgement")
    write_sheet(path, columns, [cells(study, finding) for study in studies for finding in study.findings])
