"""Page of a mapped study: the paper's Figs 7, 8, 10, 6 and 11, and every run in a table."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from validate.figures import map_figures
from validate.figures.chart import LEAST_RUNS, LEAST_VALUES, Chart
from validate.figures.page import Column, Page, Plot, Section, Table
from validate.units import percent, setting_words, signed

MOST_ROWS = 200  # Most rows on the page, the nearest runs first; the CSV has all
MOST_COLUMNS = 1_000  # Most levels in a CSV; in larger studies each run's folder has its profile
SAME_MM = 1e-6  # Precision of a profile's file
ERRORS = {
    "mean error (mm)": ("mean_error_mm", "{:.3f}".format),
    "bias (mm)": ("bias_mm", partial(signed, decimals=3)),
    "worst error (mm)": ("worst_error_mm", "{:.2f}".format),
    "at s (mm)": ("worst_at_mm", "{:.1f}".format),
    "of the length under 1 mm": ("share_under_1_mm", partial(percent, decimals=0)),
}
"""Field and format of each figure of a run's error, by label."""


def map_page(chart: Chart, fills: Sequence[map_figures.Fill], cautions: Sequence[str] = ()) -> Page:
    """Return the page of a study's map. ``cautions`` come before the cautions on its runs."""
    best, (first, second) = chart.best, chart.axes
    as_near = "unknown, since no pair was repeated"
    if chart.scatter_of_replicates_mm is not None:
        as_near = f"{sum(chart.as_near)} of {len(chart.runs)}"
    thumbnails = "The lettered runs at their end, particles by age, with the level measured from them."
    sections = [
        Section("Levels", [_levels(chart)]),
        Section(
            f"Error over {first.name} and {second.name}",
            [
                chart.flatness,
                _error_map(chart, fills),
                *([Plot("thumbnails", thumbnails, lambda: map_figures.draw_thumbnails(fills))] if fills else []),
            ],
        ),
        Section(
            f"Influence of {second.name} and {first.name}",
            [
                Plot(
                    f"influence-{axis.name.replace(' ', '-')}",
                    f"Mean error against {axis.name}, as in the paper's Fig. 10{figure}.",
                    partial(map_figures.draw_influence, chart, of),
                )
                for of, axis, figure in ((1, second, "a"), (0, first, "b"))
            ],
        ),
    ]
    if fills:
        caption = "Sections along the crack during the fill in chosen runs, coloured by age, as in the paper's Fig. 6."
        sections.append(
            Section("Fills", [_repeated(fills), Plot("fills", caption, lambda: map_figures.draw_fills(fills))])
        )
    sections += [Section("Cost", [*_cost(chart, fills)]), Section("Runs", [_runs(chart)])]
    if chart.excluded:
        sections.append(Section("Not ranked", [chart.exclusion, _left_out(chart)]))
    return Page(
        title=f"{chart.name}: {first.name} and {second.name} against {chart.readings.source}",
        lead=f"{len(chart.runs)} runs, each compared with the same readings along the crack.",
        cautions=[*cautions, *_cautions(chart)],
        finding=(
            f"Nearest to the readings: {chart.said(best)}, with a mean error of {best.mean_error_mm:.2f} mm. "
            f"{chart.beside_baselines} {chart.flatness} {chart.exclusion}"
        ),
        key_figures=[
            ("nearest pair", chart.said(best)),
            ("its mean error", f"{best.mean_error_mm:.2f} mm"),
            *((f"{line.name}, as a baseline", f"{line.mean_error_mm:.2f} mm") for line in chart.baselines),
            ("its bias", f"{signed(best.bias_mm, 2)} mm"),
            ("of the length under 1 mm", percent(best.share_under_1_mm, 0)),
            ("pairs that fit equally well", as_near),
            ("farthest pair", f"{chart.errors_mm.max():.2f} mm"),
        ],
        sections=sections,
    )


def _cautions(chart: Chart) -> Iterator[str]:
    if chart.screening:
        yield chart.screening
    yield (
        f"The nearest of {len(chart.runs)} pairs was chosen with these readings, which is a calibration: its error is "
        "the residual of the fit, not a test. Compare the pair with other readings."
    )
    yield from (*chart.fluid_warnings, *chart.unused)
    if chart.readings.data == "undeclared":
        yield "It is not declared whether the readings are measured, so a small error shows only agreement with them."
    elif chart.readings.data != "measured":
        yield f"The readings are {chart.readings.data}, so a small error shows only agreement with their source."


def _levels(chart: Chart) -> Plot:
    s_mm, numbers = chart.best.profile.s_mm, None
    if len(chart.runs) < MOST_COLUMNS:
        profiles = {f"level_of_run_{run.number}_mm": run.profile for run in chart.runs}
        levels = {name: np.interp(s_mm, profile.s_mm, profile.level_mm) for name, profile in profiles.items()}
        numbers = {"s_mm": s_mm} | levels
    caption = (
        "Level along the crack of each run, the nearest in bold, and the readings with their 95 % band, as in the "
        "paper's Fig. 7."
    )
    return Plot("levels", caption, lambda: map_figures.draw_levels_of_study(chart), numbers)


def _error_map(chart: Chart, fills: Sequence[map_figures.Fill]) -> Plot:
    first, second = chart.axes
    draw = partial(map_figures.draw_error_map, chart, [fill.run for fill in fills])
    if chart.has_surface:
        across, up, error_mm = (values[..., ::8] for values in map_figures.heat(chart))
        x, y = (values.ravel() for values in np.meshgrid(across, up))
        numbers = {first.setting: x, second.setting: y, "mean_error_mm": error_mm[::8].ravel()}
        caption = "Mean error of each run (points), interpolated linearly between them, as in the paper's Fig. 8"
        caption += "; letters mark the runs that are drawn below." if fills else "."
        return Plot("heat", caption, draw, numbers)
    letters = " and the letter of its drawing below" if fills else ""
    caption = (
        f"Mean error of each run, with its number{letters}. There is no surface between these "
        f"runs: that takes {LEAST_RUNS} or more ranked runs, with {LEAST_VALUES} or more values of each setting, that "
        "enclose two thirds of the map."
    )
    x, y = chart.pairs.T
    numbers = {first.setting: x, second.setting: y, "run": [run.number for run in chart.runs]}
    return Plot("points", caption, draw, numbers | {"mean_error_mm": chart.errors_mm})


def _repeated(fills: Sequence[map_figures.Fill]) -> str:
    repeated = [fill.course.differs_mm for fill in fills if fill.course.differs_mm is not None]
    if not repeated:
        return "These pictures were kept when the runs were computed."
    which = "These runs were" if len(repeated) == len(fills) else f"{len(repeated)} of these {len(fills)} runs were"
    differing = [differs_mm for differs_mm in repeated if differs_mm > SAME_MM]
    if not differing:
        return f"{which} repeated to draw them; their levels are the same to the last digit."
    return (
        f"{which} repeated to draw them; the levels of {len(differing)} changed, by at most {max(differing):.2g} mm on "
        "average."
    )


def _cost(chart: Chart, fills: Sequence[map_figures.Fill]) -> Iterator[str | Plot]:
    wall_s = np.array([run.wall_s for run in chart.runs])
    yield (
        f"A run took {np.median(wall_s):.1f} s (median; {wall_s.min():.1f} to {wall_s.max():.1f} s), and all runs "
        f"together {wall_s.sum():,.0f} s, on the machine of the study with its other load."
    )
    caption, numbers = "Time of a run against each setting.", None
    if fills:
        caption = f"Time of a frame against the number of moving particles, as in the paper's Fig. 11. {caption}"
        particles, frame_ms = map_figures.frame_times(fills)
        numbers = {"moving_particles": particles, "frame_ms": frame_ms}
        if (pace := map_figures.pace_of(particles, frame_ms)) is not None:
            start_ms, particle_us, explained = pace
            yield (
                f"A frame takes {start_ms:.2f} ms plus {particle_us:.2f} µs for each moving particle; "
                f"this line explains {percent(explained, 0)} of the variance of the medians."
            )
    yield Plot("cost", caption, lambda: map_figures.draw_cost(chart, fills), numbers)


def _runs(chart: Chart) -> Table:
    near = [setting_words(near) for near in chart.as_near]
    columns = [
        Column("run", "number"),
        *(
            Column(axis.label, values, "{:g}".format, axis.setting)
            for axis, values in zip(chart.axes, chart.pairs.T, strict=True)
        ),
        *(Column(head, name, text, name) for head, (name, text) in ERRORS.items()),
        Column("fits equally well", near, {"yes": "yes", "no": ""}.__getitem__, "as_near_as_the_best"),
        Column("time (s)", "wall_s", "{:.1f}".format, "wall_s"),
    ]
    more = f"; the nearest {MOST_ROWS} of {len(chart.runs)}" if len(chart.runs) > MOST_ROWS else ""
    nearest = np.argsort(chart.errors_mm, kind="stable")[:MOST_ROWS]
    return Table(f"Nearest first{more}", "runs", columns, chart.runs, nearest.tolist())


def _left_out(chart: Chart) -> Table:
    columns = [
        Column("run", "number"),
        Column("settings", [_in_words(run.settings) for run in chart.excluded]),
        Column("why", "reason.text"),
        Column("volume ratio", "volume_ratio", "{:.3f}".format),
    ]
    order = range(min(len(chart.excluded), MOST_ROWS))
    return Table("Runs that are not ranked", "left-out", columns, chart.excluded, order)


def _in_words(settings: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {setting_words(value)}" for name, value in settings.items())
