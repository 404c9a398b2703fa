"""First page of a report in words: the verdict, two sentences and four figures, for readers who were not involved."""

import numpy as np

from sealtwin.core.records import Floats
from validate.comparison import Comparison
from validate.metrics.curve_distances import level_difference
from validate.report.report_facts import faults, freezing, not_measured, parts_of, walls
from validate.result import SHOWN_REMARKS, ErrorBar, Evidence, FirstPage, Tile
from validate.run_facts import mean_sentence
from validate.sentences import sentence, tile
from validate.units import counted, signed

FLUSH_MM = 0.5  # Distance from the face up to which the level is called flush


def first_page(evidence: Evidence) -> FirstPage:
    parts = parts_of(evidence)
    return FirstPage(
        subject=sentence("page_subject", **parts),
        state=sentence("page_state", **parts),
        verdict=sentence("page_verdict", **parts),
        lead=tuple(filter(None, (sentence("page_line", **parts), _where_off(evidence)))),
        labels=_labels(evidence),
        tiles=_tiles(evidence),
        notes=_notes(evidence),
    )


def first_caption(evidence: Evidence) -> str:
    """Return a text about the bands of the first figure and the stations inside them. Returns "" without bands."""
    m, inside = evidence.comparison, 0
    if m and (u := m.uncertainty):
        band_mm = np.interp(u.stations.s_mm, u.levels.s_mm, u.levels.profile_band_95_mm)
        inside = np.count_nonzero(np.abs(u.stations.error_mm) <= band_mm)
    mean = mean_sentence(evidence.seeds)
    return sentence("first_caption", mean_of_runs=mean, inside=inside, **parts_of(evidence))


def _where_off(evidence: Evidence) -> str:
    """Return a sentence about the largest error of the level. Returns "" without readings.

    If the limit is exceeded, the sentence states instead whether the mean level or its shape is wrong.
    """
    m, readings = evidence.comparison, evidence.readings
    if m is None or readings is None:
        return ""
    error = level_difference(evidence.profile, readings)
    if m.outcome == "failed":
        shape_mm = float(np.trapezoid(np.abs(error.value - m.bias_mm), error.x) / np.ptp(error.x))
        return sentence("page_shift", m=m, shape_mm=shape_mm)
    return sentence("page_worst", m=m, worst_mm=float(error.value[np.argmax(np.abs(error.value))]))


def _labels(evidence: Evidence) -> tuple[tuple[str, str], ...]:
    """Return the warnings of the first page. All cautions after the first are shown below the page."""
    labels = [("Check first:", fault.text) for fault in faults(evidence)[:1]]
    questions = () if evidence.readings is None else evidence.readings.questions
    if remarks := [question.finding for question in questions if question.is_remark]:
        labels.append((f"{counted(len(remarks), 'remark')} on the readings:", " ".join(remarks[:SHOWN_REMARKS])))
    if evidence.comparison is not None and not evidence.comparison.basis.enough_readings:
        labels.append(("Verdict:", evidence.comparison.headline[0].text))
    if kinds := not_measured(evidence):
        labels.append(("Not a validation:", f"{', '.join(kinds)}."))
    return tuple(labels)


def _notes(evidence: Evidence) -> tuple[tuple[str, str], ...]:
    paste = evidence.run.settings["fluid"].get("material") or {}
    better = evidence.comparison is None and evidence.can_be_planned
    notes = [
        ("Walls:", walls(evidence)),
        ("Freezing:", freezing(evidence)),
        *(("Paste:", doubt) for doubt in paste.get("doubts", ())),
        ("Assumed:", ", ".join(evidence.assumed)),
        ("Note:", evidence.note),
        ("Next:", sentence("plan_next") if better else ""),
    ]
    return tuple((word, text) for word, text in notes if text)


def _tiles(evidence: Evidence) -> tuple[Tile, ...]:
    """Return the four figures of the first page, for a comparison, for a prediction, or for a level alone."""
    parts, m, p = parts_of(evidence), evidence.comparison, evidence.prediction
    if m is not None:
        instead, bars = _instead(m)
        figures = [
            tile("tile_mean_error", **parts),
            instead,
            tile("tile_volumes", **parts),
            tile("tile_tested", **parts),
        ]
    else:
        bars = ()
        if p is not None:
            median_mm = float(np.median(p.band_95_mm))
            first = tile("tile_predicted_level", **parts), tile("tile_predicted_band", median_mm=median_mm, **parts)
        else:
            first = _level_alone(evidence)
        figures = [*first, tile("tile_volumes", **parts), tile("tile_no_readings", **parts)]
    return tuple(
        Tile(title=title, figure=figure, text=text, bars=bars if number == 1 else ())
        for number, (title, figure, text) in enumerate(figures)
    )


def _instead(m: Comparison) -> tuple[tuple[str, str, str], tuple[ErrorBar, ...]]:
    """Return the simplest baseline that is closer to the readings than the simulation, or the simplest of all.

    The simplest baseline has the fewest fitted numbers. The bars are the errors of all baselines and of the simulation,
    largest first.
    """
    nearer = [baseline for baseline in m.baselines if baseline.mean_error_mm <= m.mean_error_mm]
    simpler = min(nearer or m.baselines, key=lambda baseline: (baseline.numbers, baseline.mean_error_mm), default=None)
    fitted = len(set(m.fitted or ())) if m.role == "calibrated-on" else 0
    bars = [ErrorBar(name=baseline.name, error_mm=baseline.mean_error_mm, own=False) for baseline in m.baselines]
    if bars:
        bars.append(ErrorBar(name="simulation", error_mm=m.mean_error_mm, own=True))
    ranked = tuple(sorted(bars, key=lambda bar: -bar.error_mm))
    return tile("tile_instead", simpler=simpler, fitted=fitted), ranked


def _level_alone(evidence: Evidence) -> list[tuple[str, str, str]]:
    s_mm, level_mm = evidence.profile.s_mm, evidence.profile.level_mm
    mean_mm = float(np.trapezoid(level_mm, s_mm) / np.ptp(s_mm))
    low, over = (float(np.mean(which)) for which in (level_mm < -FLUSH_MM, level_mm > FLUSH_MM))
    flush = float(np.mean(np.abs(level_mm) <= FLUSH_MM))
    return [tile("tile_level", mean_mm=mean_mm), tile("tile_flush", low=low, flush=flush, over=over, flush_mm=FLUSH_MM)]


def station_rows(evidence: Evidence) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return the first figure as a table: position, reading, its interval, simulated level and error at each station.

    Without readings the table is empty. A station beyond the compared stretch has no error.
    """
    readings, comparison, seeds = evidence.readings, evidence.comparison, evidence.seeds
    if readings is None or comparison is None:
        return ()
    stations = comparison.stations

    def compared(values_mm: Floats) -> tuple[str, ...]:
        texts = dict(zip(stations.s_mm, (signed(value_mm, 1) for value_mm in values_mm.tolist()), strict=True))
        return tuple(texts.get(s_mm, "-") for s_mm in readings.s_mm)

    band = ()
    if (uncertainty := comparison.uncertainty) is not None:
        band = (
            (
                "± of this reading alone in 19 of 20, mm",
                tuple(f"{value:.1f}" for value in uncertainty.levels.band_95_mm),
            ),
        )
    of_seeds = "simulated, mm" if seeds is None else f"mean of {len(seeds.seeds)} ± {seeds.band_95_mm:.1f}, mm"
    return (
        ("along, mm", tuple(f"{s_mm:.4g}" for s_mm in readings.s_mm)),
        ("read, mm", tuple(signed(value, 1) for value in readings.level_mm.tolist())),
        *band,
        (of_seeds, compared(stations.simulated_mm)),
        ("error, mm", compared(stations.error_mm)),
    )
