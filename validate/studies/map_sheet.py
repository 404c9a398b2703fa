"""The page of a mapped study: the paper's Figs 7, 8, 10, 6 and 11, and every run in a table."""

from collections.abc import Sequence
from string import ascii_lowercase

import numpy as np

from validate.studies.chart import Chart
from validate.studies.cost import draw_cost, frame_times, pace_of
from validate.studies.fills import Fill, draw_fills, draw_thumbnails
from validate.studies.heat import draw_heat, heat
from validate.studies.influence import draw_influence
from validate.studies.kept_volume import volume_words
from validate.studies.levels import draw_levels, level_columns
from validate.studies.sheet import Grid, Numbers, Part, Plot, Sheet
from validate.wording import percent, signed

MOST_ROWS = 200
"""Of the table on the page, the nearest first; all are in its CSV."""
MOST_COLUMNS = 1_000
"""Levels side by side in a CSV: of larger studies each profile lies in its run's folder."""
SAME_MM = 1e-6
"""What a profile's file holds."""


def map_sheet(chart: Chart, fills: Sequence[Fill]) -> Sheet:
    best = chart.best
    first, second = chart.axes
    return Sheet(
        title=f"{chart.name}: {first.name} and {second.name} against {chart.readings.source}",
        lead=f"{len(chart.runs)} runs, each held against the same readings along the crack.",
        cautions=_cautions(chart),
        finding=(
            f"Nearest to the readings: {chart.said(best)}, {best.mean_error_mm:.2f} mm off on average. "
            f"{chart.flatness} {chart.exclusion}"
        ),
        key_figures=[
            ("nearest pair", chart.said(best)),
            ("its mean error", f"{best.mean_error_mm:.2f} mm"),
            ("its bias", f"{signed(best.bias_mm, 2)} mm"),
            ("of the length under 1 mm", percent(best.share_under_1_mm, 0)),
            ("pairs as near as that", f"{sum(chart.as_near)} of {len(chart.runs)}"),
            ("farthest pair", f"{chart.worst.mean_error_mm:.2f} mm"),
        ],
        parts=[*_maps(chart, fills), *_fills(fills), _cost(chart, fills), *_tables(chart)],
    )


def lettered(chart: Chart, index: int, fill_at: tuple[float, float]) -> str:
    """The title of a chosen run: its letter on the map, its settings."""
    said = ", ".join(axis.said(value) for axis, value in zip(chart.axes, fill_at, strict=True))
    return f"{ascii_lowercase[index]}  {said}"


def _cautions(chart: Chart) -> list[str]:
    told = [
        f"The nearest of {len(chart.runs)} pairs was chosen by these very readings: that is a calibration. Its error "
        "is what the fit leaves over, and predicts nothing until it is held against readings that it has not seen."
    ]
    told += volume_words({run.run.number: run.run.volume_ratio for run in chart.runs})
    if chart.readings.data != "measured":
        told.append(
            f"The readings are {chart.readings.data}: this can show consistency with what they were made from, no more."
        )
    return told


def _maps(chart: Chart, fills: Sequence[Fill]) -> list[Part]:
    first, second = chart.axes
    columns, levels_mm = level_columns(chart)
    levels = None if len(columns) > MOST_COLUMNS else Numbers(columns, levels_mm.tolist())
    across, up, error_mm = heat(chart)
    cells = [
        [float(x), float(y), None if np.isnan(error_mm[row, column]) else float(error_mm[row, column])]
        for row, y in list(enumerate(up))[::8]
        for column, x in list(enumerate(across))[::8]
    ]
    letters = "; letters name the runs that are drawn below" if fills else ""
    thumbnails = [
        Plot(
            "thumbnails",
            "The lettered runs at their end, particles by age, with the level read from them.",
            lambda on: draw_thumbnails(fills, on),
        )
    ]
    return [
        Part(
            "Levels",
            [],
            [
                Plot(
                    "levels",
                    "The level along the crack of every run, the nearest one in bold, and the readings with their "
                    "95 % band, as in the paper's Fig. 7.",
                    lambda on: draw_levels(chart, on),
                    levels,
                )
            ],
        ),
        Part(
            f"Error over {first.name} and {second.name}",
            [chart.flatness],
            [
                Plot(
                    "heat",
                    f"Mean error between the runs, which are crosses, by linear interpolation, as in the paper's "
                    f"Fig. 8{letters}.",
                    lambda on: draw_heat(chart, [fill.run for fill in fills], on),
                    Numbers([first.setting, second.setting, "mean_error_mm"], cells),
                ),
                *(thumbnails if fills else []),
            ],
        ),
        Part(
            f"What {second.name} and {first.name} do",
            [],
            [
                Plot(
                    f"influence-{chart.axes[of].name.replace(' ', '-')}",
                    f"Mean error over {chart.axes[of].name}, as in the paper's Fig. 10{figure}.",
                    lambda on, of=of: draw_influence(chart, of, on),
                )
                for of, figure in ((1, "a"), (0, "b"))
            ],
        ),
    ]


def _fills(fills: Sequence[Fill]) -> list[Part]:
    if not fills:
        return []
    return [
        Part(
            "Fills",
            [_again(fills)],
            [
                Plot(
                    "fills",
                    "Sections along the crack as chosen runs fill it, particles by age, as in the paper's Fig. 6.",
                    lambda on: draw_fills(fills, on),
                )
            ],
        )
    ]


def _again(fills: Sequence[Fill]) -> str:
    differing = [fill.rerun_differs_mm for fill in fills if fill.rerun_differs_mm > SAME_MM]
    if not differing:
        return "These runs were computed once more to be drawn; their levels came out the same to the last digit."
    return (
        f"These runs were computed once more to be drawn; the levels of {len(differing)} of {len(fills)} came out "
        f"otherwise, by {max(differing):.2g} mm on average at most."
    )


def _cost(chart: Chart, fills: Sequence[Fill]) -> Part:
    wall_s = np.array([run.run.wall_s for run in chart.runs])
    words = [
        f"The median time of a run is {np.median(wall_s):.1f} s, the shortest {wall_s.min():.1f} s, the longest "
        f"{wall_s.max():.1f} s; all together took {wall_s.sum():,.0f} s, on the machine that ran the "
        "study, with whatever else it did."
    ]
    numbers = None
    if fills:
        particles, frame_ms = frame_times(fills)
        if (pace := pace_of(particles, frame_ms)) is not None:
            words.append(
                f"A frame takes {pace.start_ms:.2f} ms and {pace.particle_us:.2f} µs more for each moving particle; "
                f"the line explains {percent(pace.explained, 0)} of the variance of the medians."
            )
        numbers = Numbers(["moving_particles", "frame_ms"], np.column_stack([particles, frame_ms]).tolist())
    caption = "Times of whole runs over each setting"
    if fills:
        caption = f"Time of a frame over the particles that move in it, as in the paper's Fig. 11. {caption}"
    return Part("Cost", words, [Plot("cost", f"{caption}.", lambda on: draw_cost(chart, fills, on), numbers)])


def _tables(chart: Chart) -> list[Part]:
    first, second = chart.axes
    order = np.argsort(chart.errors_mm, kind="stable")
    head = ["run", first.label, second.label, "mean error (mm)", "bias (mm)", "worst error (mm)", "at s (mm)"]
    head += ["of the length under 1 mm", "as near as the best", "time (s)"]
    rows = []
    for index in order[:MOST_ROWS]:
        run = chart.runs[index]
        rows.append(
            [
                str(run.run.number),
                f"{run.at[0]:g}",
                f"{run.at[1]:g}",
                f"{run.mean_error_mm:.3f}",
                signed(run.bias_mm, 3),
                f"{run.worst_error_mm:.2f}",
                f"{run.worst_at_mm:.1f}",
                percent(run.share_under_1_mm, 0),
                "yes" if chart.as_near[index] else "",
                f"{run.run.wall_s:.1f}",
            ]
        )
    columns = ["run", first.setting, second.setting, "mean_error_mm", "bias_mm", "worst_error_mm", "worst_at_mm"]
    columns += ["share_under_1_mm", "as_near_as_the_best", "wall_s"]
    numbers = [
        [
            run.run.number,
            *run.at,
            run.mean_error_mm,
            run.bias_mm,
            run.worst_error_mm,
            run.worst_at_mm,
            run.share_under_1_mm,
            "yes" if near else "no",
            run.run.wall_s,
        ]
        for run, near in zip(chart.runs, chart.as_near, strict=True)
    ]
    shown = "" if len(order) <= MOST_ROWS else f"; the nearest {MOST_ROWS} of {len(order)}"
    parts = [Part("Runs", [], [Grid(f"The nearest first{shown}", head, rows, "runs", Numbers(columns, numbers))])]
    if chart.excluded:
        left = [
            [str(each.number), ", ".join(f"{name} = {value}" for name, value in each.settings.items()), each.reason]
            for each in chart.excluded
        ]
        parts.append(
            Part(
                "Left out",
                [chart.exclusion],
                [
                    Grid(
                        "Runs without a result",
                        ["run", "settings", "why"],
                        left[:MOST_ROWS],
                        "left-out",
                        Numbers(["run", "settings", "why"], left),
                    )
                ],
            )
        )
    return parts
