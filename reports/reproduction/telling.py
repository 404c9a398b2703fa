"""The reproduction as a page of Markdown, which a repository shows; its readings are called RECONSTRUCTED."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np

from reports.reproduction.claims import NEAREST
from reports.reproduction.judging import NOT_COMPUTED, Finding, Judgement
from reports.reproduction.kept import Kept
from reports.reproduction.redrawn import ALONG_MM, FIRST_MM, LEVEL_MM, SETS, FirstReading
from reports.reproduction.scatter import Pair, Replicates
from reports.reproduction.surface import CHOSEN
from reports.reproduction.unequal import OF_ALL, Careless
from sealtwin.core.records import Floats
from sealtwin.core.stage_keys import UNNUMBERED, number_words
from sealtwin.trial.stage_numbers import NUMBERS
from validate.figures.chart import Chart

FIGURES = (
    ("levels", "All levels and the RECONSTRUCTED readings, the nearest in bold (the paper's Fig. 7)"),
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
    """The runs of one reading of the paper's geometry."""

    radius_mm: float
    """Of its particles."""
    chart: Chart
    finer_mm: Mapping[tuple[float, float], float]
    """Mean error of the pairs that the paper names, with particles of its size."""
    shown: Sequence[str]
    """Which of the figures lie beside the page."""
    first: Sequence[FirstReading]
    """What other first readings would give, for the chosen pair."""
    replicates: Replicates | None
    """The pairs that were run again with other seeds; None: none yet."""


@dataclass(frozen=True)
class Told:
    """One reading of the paper's geometry, as the page has it."""

    name: str
    """In file names."""
    title: str
    study: Kept
    times: Kept | None
    """None: not computed yet."""
    findings: Sequence[Finding]


@dataclass(frozen=True)
class Feeding:
    """What similaritymeasures makes of unequal samplings, in one study."""

    chart: Chart
    samplings: Sequence[Careless]
    """Of the pair that the paper chose."""
    exact_mm: float
    all_mm: Floats
    """Of every run, with ``OF_ALL`` points."""


def page(parts: Sequence[Told], missing: Mapping[str, str], slots: Finding, feeding: Mapping[str, Any]) -> str:
    """The page of the parts that are computed; ``missing`` tells by title how far the others are."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=False,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    claims = [
        {"claim": each[0].claim, "paper": each[0].paper, "found": each}
        for each in zip(*(part.findings for part in parts), strict=True)
    ]
    judgements = sum(len(part.findings) for part in parts) + 1  # The slots' beside them
    return environment.get_template("page.md.j2").render(
        studies=[_listed(part) for part in parts],
        missing=missing,
        claims=claims,
        slots=slots,
        feeding=feeding,
        sets=SETS,
        along_mm=f"{ALONG_MM:g}",
        level_mm=f"{LEVEL_MM:g}",
        first_mm=[f"{level:g}" for level in FIRST_MM],
        middle_error=_share_error(0.5),
        limit_error=_share_error(0.05),
        judgements=judgements,
        by_chance=f"{0.05 * judgements:.0f}",
    )


def _share_error(share: float) -> str:
    """Return half of the 95 % interval of a share of the draws, in percent."""
    return f"{196 * np.sqrt(share * (1 - share) / SETS):.1f}"


def _listed(part: Told) -> dict[str, Any]:
    words = part.study.told
    return {
        **words,
        "name": part.name,
        "title": part.title,
        "computed": part.study.computed,
        "computed_by": number_words(part.study.stage_numbers or dict.fromkeys(NUMBERS, UNNUMBERED)),
        "timed": None if part.times is None else part.times.computed,
        "not_computed": [finding.name for finding in part.findings if finding.ours == NOT_COMPUTED],
        "claims": len(part.findings),
        "judged": [
            (judgement, [finding for finding in part.findings if finding.judgement == judgement])
            for judgement in get_args(Judgement)
        ],
        "figures": [(name, caption) for name, caption in FIGURES if name in words["shown"]],
    }


def tell(study: Study) -> dict[str, Any]:
    """Return what the page says of a study beside its findings."""
    chart = study.chart
    wall_s = np.array([run.wall_s for run in chart.runs])
    return {
        "radius_mm": f"{study.radius_mm:g}",
        "runs": len(chart.runs),
        "exclusion": chart.exclusion,
        "nearest": f"{chart.said(chart.best)}, {chart.best.mean_error_mm:.2f} mm",
        "flatness": chart.flatness,
        "median_s": f"{np.median(wall_s):.0f}",
        "least_s": f"{wall_s.min():.0f}",
        "most_s": f"{wall_s.max():.0f}",
        "radii": [_radii(chart, pair, fine_mm) for pair, fine_mm in study.finer_mm.items()],
        "shown": list(study.shown),
        "first": [_first(each) for each in study.first],
        "scatter_mm": f"{chart.scatter_mm:.2f}",
        "again": None if study.replicates is None else _again(chart, study.replicates),
    }


def _first(each: FirstReading) -> dict[str, str]:
    error = each.error
    return {
        "level": f"{each.level_mm:.0f}",
        "mean": f"{error.mean_mm:.2f}",
        "worst": f"{error.worst_mm:.1f}",
        "at": f"{error.worst_at_mm:.0f}",
    }


def _again(chart: Chart, replicates: Replicates) -> dict[str, Any]:
    """The pairs that were run again, and by how much the chosen one is farther off than the nearest in those runs."""
    other_mm = replicates.errors_mm(chart.readings, [chart.readings])[0, :, 1:]
    own_mm = {run.at: run.mean_error_mm for run in chart.runs}
    rows = [
        {
            "pair": _named(pair),
            "own": f"{own_mm[pair]:.2f}",
            "mean": f"{errors_mm.mean():.2f}",
            "sd": f"{errors_mm.std(ddof=1):.2f}",
        }
        for pair, errors_mm in zip(replicates.pairs, other_mm, strict=True)
    ]
    scatter: dict[str, Any] = {"seeds": other_mm.shape[1], "rows": rows, "gaps": []}
    for name, pair in (("nearest of ours", chart.best.at), ("nearest of the paper's", NEAREST)):
        if pair in replicates.pairs and pair != CHOSEN:
            chosen_mm, nearest_mm = (other_mm[replicates.pairs.index(each)] for each in (CHOSEN, pair))
            doubt_mm = np.hypot(chosen_mm.std(ddof=1), nearest_mm.std(ddof=1)) / np.sqrt(len(chosen_mm))
            gap = f"{chosen_mm.mean() - nearest_mm.mean():+.2f} mm, standard uncertainty {doubt_mm:.2f} mm"
            scatter["gaps"].append((f"{name}, {_named(pair)}", gap))
    return scatter


def _named(pair: Pair) -> str:
    return f"U = {pair[0]:g}, D = {pair[1]:g} cm"


def _radii(chart: Chart, pair: tuple[float, float], fine_mm: float) -> dict[str, str]:
    coarse = next(run for run in chart.runs if run.at == pair)
    return {"pair": chart.said(coarse), "coarse": f"{coarse.mean_error_mm:.2f}", "fine": f"{fine_mm:.2f}"}


def tell_feeding(feeding: Feeding) -> dict[str, Any]:
    """Return what the page says of unequal samplings."""
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
