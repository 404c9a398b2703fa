"""The reproduction as a page of Markdown, which a repository shows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np

from reports.reproduction.claims import Finding, Judgement
from reports.reproduction.redrawn import ALONG_MM, LEVEL_MM, SETS
from reports.reproduction.unequal import OF_ALL, Careless
from sealtwin.core.records import Floats
from validate.study_figures.chart import Chart

FIGURES = (
    ("levels", "All levels, the nearest in bold (the paper's Fig. 7)"),
    ("heat", "Mean error over U and D (its Fig. 8)"),
    ("thumbnails", "The lettered runs at their end (its Fig. 8)"),
    ("influence-D", "Influence of D (its Fig. 10a)"),
    ("influence-U", "Influence of U (its Fig. 10b)"),
    ("fills", "Chosen runs as they fill the crack (its Fig. 6)"),
    ("cost", "Time of a frame over the particles that move (its Fig. 11), and of whole runs"),
)
"""Names of their files, and what they show."""


@dataclass(frozen=True)
class Study:
    """One reading of the paper's geometry, run and judged."""

    name: str
    """In file names."""
    title: str
    radius_mm: float
    """Of its particles."""
    chart: Chart
    findings: Sequence[Finding]
    finer_mm: Mapping[tuple[float, float], float]
    """Mean error of the pairs that the paper names, with particles of its size."""
    shown: Sequence[str]
    """Which of the figures lie beside the page."""


@dataclass(frozen=True)
class Feeding:
    """What similaritymeasures makes of unequal samplings, in one study."""

    chart: Chart
    samplings: Sequence[Careless]
    """Of the pair that the paper chose."""
    exact_mm: float
    all_mm: Floats
    """Of every run, with ``OF_ALL`` points."""


def page(studies: Sequence[Study], feeding: Feeding) -> str:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=False,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    claims = [
        {"name": found[0].name, "paper": found[0].paper, "found": found}
        for found in zip(*(study.findings for study in studies), strict=True)
    ]
    return environment.get_template("page.md.j2").render(
        studies=[_told(study) for study in studies],
        claims=claims,
        feeding=_fed(feeding),
        sets=SETS,
        along_mm=f"{ALONG_MM:g}",
        level_mm=f"{LEVEL_MM:g}",
    )


def _told(study: Study) -> dict[str, Any]:
    chart = study.chart
    wall_s = np.array([run.wall_s for run in chart.runs])
    return {
        "name": study.name,
        "title": study.title,
        "radius_mm": f"{study.radius_mm:g}",
        "runs": len(chart.runs),
        "exclusion": chart.exclusion,
        "nearest": f"{chart.said(chart.best)}, {chart.best.mean_error_mm:.2f} mm",
        "flatness": chart.flatness,
        "claims": len(study.findings),
        "judged": [
            (judgement, [finding for finding in study.findings if finding.judgement == judgement])
            for judgement in get_args(Judgement)
        ],
        "median_s": f"{np.median(wall_s):.0f}",
        "least_s": f"{wall_s.min():.0f}",
        "most_s": f"{wall_s.max():.0f}",
        "radii": [_radii(chart, pair, fine_mm) for pair, fine_mm in study.finer_mm.items()],
        "figures": [(name, caption) for name, caption in FIGURES if name in study.shown],
    }


def _radii(chart: Chart, pair: tuple[float, float], fine_mm: float) -> dict[str, str]:
    coarse = next(run for run in chart.runs if run.at == pair)
    return {"pair": chart.said(coarse), "coarse": f"{coarse.mean_error_mm:.2f}", "fine": f"{fine_mm:.2f}"}


def _fed(feeding: Feeding) -> dict[str, Any]:
    from scipy.stats import rankdata

    chart, exact_mm = feeding.chart, feeding.chart.errors_mm
    ratio = feeding.all_mm / exact_mm
    ranks = np.corrcoef(rankdata(exact_mm), rankdata(feeding.all_mm))
    return {
        "readings": len(chart.readings.s_mm),
        "samplings": [
            {
                "points": each.points,
                "error": f"{each.error_mm:.2f}",
                "ratio": f"{each.error_mm / feeding.exact_mm:.2f}",
            }
            for each in feeding.samplings
        ],
        "exact": f"{feeding.exact_mm:.2f}",
        "of_all": OF_ALL,
        "least": f"{ratio.min():.2f}",
        "most": f"{ratio.max():.2f}",
        "rank": f"{ranks[0, 1]:.2f}",
        "nearest": chart.said(chart.best),
        "nearest_fed": chart.said(chart.runs[int(np.argmin(feeding.all_mm))]),
    }
