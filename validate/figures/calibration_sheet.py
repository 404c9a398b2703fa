"""Page of a calibration: readings and the posterior's predictions of them, and the settings that it determines."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from sealtwin.core.records import Floats
from validate.calibration.free import Marginal
from validate.calibration.posterior import SMOOTH_ERRORS_MM, SMOOTH_LENGTH_MM
from validate.calibration.summary import Calibrated, Prediction
from validate.figures import theme
from validate.figures.figure_sheet import FigureSheet, FigureTable, Numbers, Plot, SheetSection, wide_axes
from validate.units import percent

BARS = 30  # Number of bars of a histogram


def calibration_sheet(calibrated: Calibrated) -> FigureSheet:
    sections = [_levels(calibrated, one, number) for number, one in enumerate(calibrated.predictions, start=1)]
    if calibrated.draws is not None:
        sections += [_settings(calibrated, calibrated.draws), _combinations(calibrated)]
    sections.append(_gates(calibrated))
    names = [name for (name, _), count in zip(calibrated.reaches, calibrated.drafts, strict=True) if count]
    whose = "them" if all(calibrated.drafts) else f"those of {' and '.join(names)}"
    drafts = f", {max(calibrated.drafts)} of {whose} drafts" if names else ""
    return FigureSheet(
        title=f"{calibrated.name}: calibration",
        lead=(
            f"{calibrated.runs} runs of each trial{drafts}, for a particle radius of "
            f"{' and '.join(f'{radius:g}' for radius in sorted(set(calibrated.radius_mm)))} mm; "
            f"{len(calibrated.frees)} free settings."
        ),
        cautions=calibrated.cautions,
        finding=calibrated.finding,
        key_figures=[
            (one.free.label, f"{one.best:.3g} ({one.low:.3g} to {one.high:.3g})") for one in calibrated.marginals
        ],
        parts=sections,
    )


def _levels(calibrated: Calibrated, one: Prediction, number: int) -> SheetSection:
    caption = (
        f"Readings ({one.data}) with their 95 % intervals, and the mean and 95 % band that the posterior predicts."
    )
    columns = ["s_mm", "read_mm", "reading_half_width_mm", "predicted_mm", "band_half_width_mm"]
    rows = np.column_stack([one.s_mm, one.read_mm, one.error_mm, one.mean_mm, one.half_mm]).tolist()
    judged = (
        f"RMS error of the predicted mean {one.rms_mm:.2f} mm, of the readings' mean {one.flat_rms_mm:.2f} mm; "
        f"{percent(one.held, 0)} of {len(one.s_mm)} stations are in the band."
    )
    used = (
        "The settings were fitted to these readings, so this error is the residual of the fit, not a test."
        if one.role == "calibrated"
        else "No setting was fitted to these readings, so this is a prediction."
    )
    mark = "EMULATED " if calibrated.emulated and one.data != "measured" else ""
    plot = Plot(f"levels-{number}", caption, partial(draw_prediction, one, mark), Numbers(columns, rows))
    return SheetSection(f"{one.trial}: {one.role}", [judged, used], [plot])


@theme.themed()
def draw_prediction(one: Prediction, mark: str = "") -> Figure:
    """Draw the readings over the band that is predicted for them."""
    figure, axes = wide_axes(3.8, face=True)
    theme.draw_band(axes, one.s_mm, one.mean_mm, one.half_mm, theme.SIMULATED, 0.25, "95 % band of a reading")
    axes.plot(one.s_mm, one.mean_mm, color=theme.SIMULATED, linewidth=2.2, label="predicted mean")
    read = {"color": theme.MEASURED, "linestyle": "none", "marker": "o", "markersize": 3.5, "elinewidth": 1.2}
    axes.errorbar(one.s_mm, one.read_mm, one.error_mm, **read, label=f"{mark}readings, 95 %")
    ends_mm = np.concatenate([one.mean_mm - one.half_mm, one.mean_mm + one.half_mm, one.read_mm])
    axes.set_ylim(ends_mm.min() - 0.5, max(ends_mm.max(), 0.0) + 0.5)
    theme.label_axes(axes, theme.ALONG, theme.LEVEL, f"{theme.printable(one.trial)}: {one.role}")
    axes.legend(loc="best")
    return figure


def _settings(calibrated: Calibrated, draws: Floats) -> SheetSection:
    head = ["setting", "range", "best", "5 %", "95 %", "width over prior width", "identified"]
    rows = [
        [
            one.free.label,
            f"{one.free.low:g} to {one.free.high:g}" + (", measured" if one.free.measured else ""),
            *(f"{value:.3g}" for value in (one.best, one.low, one.high)),
            percent(one.width_over_prior, 0),
            "yes" if one.identified else "no",
        ]
        for one in calibrated.marginals
    ]
    numbers = [
        [one.free.name, one.free.low, one.free.high, one.best, one.low, one.high, one.width_over_prior]
        for one in calibrated.marginals
    ]
    columns = ["setting", "low", "high", "best", "q05", "q95", "width_over_prior"]
    caption = "The posterior of each free setting (bars) over its prior (line)."
    table = FigureTable("Free settings", head, rows, "settings", Numbers(columns, numbers))
    plot = Plot("marginals", caption, partial(_draw, calibrated.marginals, draws))
    return SheetSection("Settings", calibrated.advice, [plot, table])


@theme.themed()
def _draw(marginals: Sequence[Marginal], draws: Floats) -> Figure:
    columns = min(len(marginals), 3)
    lines = -(-len(marginals) // columns)
    figure = theme.wide_figure(2.6 * lines)
    for number, one in enumerate(marginals):
        axes = figure.add_subplot(lines, columns, number + 1)
        edges = np.linspace(0, 1, BARS + 1)
        density, _ = np.histogram(draws[:, number], edges, density=True)
        values = one.free.values(edges)
        axes.stairs(density, values, fill=True, color=theme.SIMULATED, alpha=0.6)
        shares = np.linspace(0, 1, 200)
        prior = np.exp(one.free.log_prior(shares) - one.free.log_prior(shares).max())
        axes.plot(one.free.values(shares), prior / prior.mean(), color=theme.INK, linewidth=1.2)
        axes.axvline(one.best, color=theme.MEASURED, linewidth=1.4, linestyle="--")
        _label(axes, one)
    return figure


def _label(axes: "theme.Axes", one: Marginal) -> None:
    if one.free.logarithmic:
        axes.set_xscale("log")
        axes.minorticks_off()
    ticks = one.free.values(np.array([0.0, 0.5, 1.0]))
    axes.set_xticks(ticks, [f"{value:.2g}" for value in ticks])
    axes.set_xlim(one.free.low, one.free.high)
    axes.set_yticks([])
    title = "identified" if one.identified else "not identified"
    theme.label_axes(axes, one.free.label, "", title)


def _combinations(calibrated: Calibrated) -> SheetSection:
    sentence = (
        "The combinations of settings that the readings determine best and worst. The deviation is relative to that of "
        "the prior: 1 means that the readings contain no information on the combination."
    )
    rows = [[one.said(calibrated.frees), f"{one.deviation:.2f}"] for one in calibrated.combinations]
    numbers = Numbers(
        [*(free.name for free in calibrated.frees), "deviation_over_prior"],
        [[*one.parts, one.deviation] for one in calibrated.combinations],
    )
    table = FigureTable("Best determined first", ["combination", "deviation"], rows, "combinations", numbers)
    return SheetSection("Combinations", [sentence], [table])


def _gates(calibrated: Calibrated) -> SheetSection:
    head = ["trial", "residual (mm)", "noise (mm)", "components", "scatter of runs (mm)", "possible"]
    rows = [
        [
            name,
            f"{reach.residual_mm:.2f}",
            f"{reach.noise_mm:.2f}",
            str(reach.components),
            f"{noise:.2f}",
            "yes" if reach.possible else "no",
        ]
        for (name, reach), noise in zip(calibrated.reaches, calibrated.run_noise_mm, strict=True)
    ]
    sentences = [
        "Residual: the part of the readings that no combination of the runs fits. Noise: the standard uncertainty of a "
        "reading, and of the components that are left out.",
        f"The error of the best setting within the ranges is {calibrated.least_implausibility:.2f} times what the "
        "uncertainty of readings, runs and emulator allows; above 1, no setting is possible.",
    ]
    sizes = SMOOTH_ERRORS_MM
    sentences.append(
        "The intervals allow for smooth errors of readings and model together, which no setting stands for and which "
        f"one profile cannot show: {sizes['common']:g} mm at all stations alike, {sizes['tilt']:g} mm of tilt at "
        f"either end, {sizes['smooth']:g} mm over {SMOOTH_LENGTH_MM:g} mm, and {sizes['ends']:g} mm at each end of the "
        "path, as standard uncertainties."
    )
    if calibrated.discrepancy_mm is not None:
        sentences.append(
            f"Further error of the model, estimated from all trials together: {calibrated.discrepancy_mm:.2f} mm."
        )
    return SheetSection("Gates", sentences, [FigureTable("Trials", head, rows, "gates")])
