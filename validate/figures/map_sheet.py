"""Page of a mapped study: the paper's Figs 7, 8, 10, 6 and 11, and every run in a table."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from validate.figures import map_figures
from validate.figures.chart import LEAST_RUNS, LEAST_VALUES, Chart
from validate.figures.figure_sheet import NONE, Cell, FigureSheet, FigureTable, Numbers, Plot, SheetSection
from validate.figures.side_by_side import setting_words
from validate.units import percent, signed

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


def map_sheet(chart: Chart, fills: Sequence[map_figures.Fill], cautions: Sequence[str] = ()) -> FigureSheet:
    """Return the page of a study's map. ``cautions`` come before the cautions on its runs."""
    best = chart.best
    as_near = "unknown, since no pair was repeated"
    if chart.scatter_of_replicates_mm is not None:
        as_near = f"{sum(chart.as_near)} of {len(chart.runs)}"
    first, second = chart.axes
    sections = [_levels(chart), _map(chart, fills), _influences(chart)]
    if fills:
        caption = "Sections along the crack during the fill in chosen runs, coloured by age, as in the paper's Fig. 6."
        sections.append(
            SheetSection("Fills", [_again(fills)], [Plot("fills", caption, lambda: map_figures.draw_fills(fills))])
        )
    sections += [_cost(chart, fills), SheetSection("Runs", [], [_runs(chart)])]
    if chart.excluded:
        sections.append(SheetSection("Not ranked", [chart.exclusion], [_left_out(chart)]))
    return FigureSheet(
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
            *((f"{one.name}, as a baseline", f"{one.mean_error_mm:.2f} mm") for one in chart.baselines),
            ("its bias", f"{signed(best.bias_mm, 2)} mm"),
            ("of the length under 1 mm", percent(best.share_under_1_mm, 0)),
            ("pairs that fit equally well", as_near),
            ("farthest pair", f"{chart.errors_mm.max():.2f} mm"),
        ],
        parts=sections,
    )


def _cautions(chart: Chart) -> list[str]:
    sentences = [chart.screening] if chart.screening else []
    sentences += [
        f"The nearest of {len(chart.runs)} pairs was chosen with these readings, which is a calibration: its error is "
        "the residual of the fit, not a test. Compare the pair with other readings.",
        *chart.fluid_warnings,
        *chart.unused,
    ]
    if chart.readings.data == "undeclared":
        sentences.append(
            "It is not declared whether the readings are measured, so a small error shows only agreement with them."
        )
    elif chart.readings.data != "measured":
        sentences.append(
            f"The readings are {chart.readings.data}, so a small error shows only agreement with their source."
        )
    return sentences


def _levels(chart: Chart) -> SheetSection:
    s_mm, numbers = chart.best.profile.s_mm, None
    if len(chart.runs) < MOST_COLUMNS:
        levels_mm = [np.interp(s_mm, run.profile.s_mm, run.profile.level_mm) for run in chart.runs]
        columns = ["s_mm", *(f"level_of_run_{run.number}_mm" for run in chart.runs)]
        numbers = Numbers(columns, np.column_stack([s_mm, *levels_mm]).tolist())
    caption = (
        "Level along the crack of each run, the nearest in bold, and the readings with their 95 % band, as in the "
        "paper's Fig. 7."
    )
    return SheetSection(
        "Levels", [], [Plot("levels", caption, lambda: map_figures.draw_levels_of_study(chart), numbers)]
    )


def _map(chart: Chart, fills: Sequence[map_figures.Fill]) -> SheetSection:
    first, second = chart.axes
    plots = [_surface(chart, fills) if chart.has_surface else _points(chart, fills)]
    if fills:
        caption = "The lettered runs at their end, particles by age, with the level measured from them."
        plots.append(Plot("thumbnails", caption, lambda: map_figures.draw_thumbnails(fills)))
    return SheetSection(f"Error over {first.name} and {second.name}", [chart.flatness], plots)


def _surface(chart: Chart, fills: Sequence[map_figures.Fill]) -> Plot:
    first, second = chart.axes
    across, up, error_mm = (values[..., ::8] for values in map_figures.heat(chart))
    cells = [
        [float(x), float(y), None if np.isnan(error) else float(error)]
        for y, row in zip(up, error_mm[::8], strict=True)
        for x, error in zip(across, row, strict=True)
    ]
    caption = "Mean error, interpolated linearly between the runs (crosses), as in the paper's Fig. 8"
    caption += "; letters mark the runs that are drawn below." if fills else "."
    numbers = Numbers([first.setting, second.setting, "mean_error_mm"], cells)
    return Plot("heat", caption, lambda: map_figures.draw_heat(chart, [fill.run for fill in fills]), numbers)


def _points(chart: Chart, fills: Sequence[map_figures.Fill]) -> Plot:
    first, second = chart.axes
    caption = "Mean error of each run, with its number"
    caption += " and the letter of its drawing below. " if fills else ". "
    caption += (
        f"There is no surface between these runs: that takes {LEAST_RUNS} or more ranked runs, with {LEAST_VALUES} or "
        "more values of each setting, that enclose two thirds of the map."
    )
    cells = [[*run.at, run.number, run.mean_error_mm] for run in chart.runs]
    numbers = Numbers([first.setting, second.setting, "run", "mean_error_mm"], cells)
    return Plot("points", caption, lambda: map_figures.draw_points(chart, [fill.run for fill in fills]), numbers)


def _influences(chart: Chart) -> SheetSection:
    first, second = chart.axes
    plots = [
        Plot(
            f"influence-{axis.name.replace(' ', '-')}",
            f"Mean error against {axis.name}, as in the paper's Fig. 10{figure}.",
            lambda of=of: map_figures.draw_influence(chart, of),
        )
        for of, axis, figure in ((1, second, "a"), (0, first, "b"))
    ]
    return SheetSection(f"Influence of {second.name} and {first.name}", [], plots)


def _again(fills: Sequence[map_figures.Fill]) -> str:
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


def _cost(chart: Chart, fills: Sequence[map_figures.Fill]) -> SheetSection:
    wall_s = np.array([run.wall_s for run in chart.runs])
    words = [
        f"A run took {np.median(wall_s):.1f} s (median; {wall_s.min():.1f} to {wall_s.max():.1f} s), and all runs "
        f"together {wall_s.sum():,.0f} s, on the machine of the study with its other load."
    ]
    caption, numbers = "Time of a run against each setting.", None
    if fills:
        caption = f"Time of a frame against the number of moving particles, as in the paper's Fig. 11. {caption}"
        particles, frame_ms = map_figures.frame_times(fills)
        numbers = Numbers(["moving_particles", "frame_ms"], np.column_stack([particles, frame_ms]).tolist())
        if (pace := map_figures.pace_of(particles, frame_ms)) is not None:
            start_ms, particle_us, explained = pace
            words.append(
                f"A frame takes {start_ms:.2f} ms plus {particle_us:.2f} µs for each moving particle; "
                f"this line explains {percent(explained, 0)} of the variance of the medians."
            )
    return SheetSection("Cost", words, [Plot("cost", caption, lambda: map_figures.draw_cost(chart, fills), numbers)])


def _runs(chart: Chart) -> FigureTable:
    head = ["run", *(axis.label for axis in chart.axes), *ERRORS, "fits equally well", "time (s)"]
    columns = ["run", *(axis.setting for axis in chart.axes), *(name for name, _ in ERRORS.values())]
    rows: list[list[str]] = []
    numbers: list[list[Cell]] = []
    for run, near in zip(chart.runs, chart.as_near, strict=True):
        errors = [(getattr(run, name), written) for name, written in ERRORS.values()]
        numbers.append([run.number, *run.at, *(value for value, _ in errors), "yes" if near else "no", run.wall_s])
        row = [str(run.number), *(f"{value:g}" for value in run.at), *(written(value) for value, written in errors)]
        rows.append([*row, "yes" if near else "", f"{run.wall_s:.1f}"])
    title = "Nearest first"
    if len(rows) > MOST_ROWS:
        title += f"; the nearest {MOST_ROWS} of {len(rows)}"
    nearest = [rows[index] for index in np.argsort(chart.errors_mm, kind="stable")[:MOST_ROWS]]
    return FigureTable(title, head, nearest, "runs", Numbers([*columns, "as_near_as_the_best", "wall_s"], numbers))


def _left_out(chart: Chart) -> FigureTable:
    head = ["run", "settings", "why", "volume ratio"]
    rows = [
        [
            str(each.number),
            ", ".join(f"{name} = {setting_words(value)}" for name, value in each.settings.items()),
            each.reason,
            NONE if each.volume_ratio is None else f"{each.volume_ratio:.3f}",
        ]
        for each in chart.excluded
    ]
    return FigureTable("Runs that are not ranked", head, rows[:MOST_ROWS], "left-out", Numbers(head, rows))
