"""Page of a calibration: readings, predictions of them by the posterior, and the settings that they determine."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from sealtwin.core.records import Floats
from validate.calibration.posterior import SMOOTH_ERRORS_MM, SMOOTH_LENGTH_MM
from validate.calibration.summary import Calibrated, Prediction
from validate.figures.page import FigureColumn, FigureTable, Page, Plot, Section
from validate.figures.theme import (
    ALONG,
    INK,
    LEVEL,
    MEASURED,
    SIMULATED,
    draw_curve,
    label_axes,
    printable,
    themed,
    wide_axes,
    wide_figure,
)
from validate.units import percent, setting_words

BARS = 30  # Number of bars of a histogram
DIGITS = "{:.3g}".format


def calibration_page(calibrated: Calibrated) -> Page:
    sections = [
        _levels(calibrated, prediction, number) for number, prediction in enumerate(calibrated.predictions, start=1)
    ]
    if calibrated.draws is not None:
        sections += [_settings(calibrated, calibrated.draws)]
    drafts = f", with {sum(calibrated.drafts)} drafts among them" if any(calibrated.drafts) else ""
    return Page(
        title=f"{calibrated.name}: calibration",
        lead=(
            f"{calibrated.runs} runs of each trial{drafts}, for a particle radius of "
            f"{' and '.join(f'{radius:g}' for radius in sorted(set(calibrated.radius_mm)))} mm; "
            f"{len(calibrated.frees)} free settings."
        ),
        cautions=calibrated.cautions,
        finding=calibrated.finding,
        key_figures=[
            (marginal.free.label, f"{marginal.best:.3g} ({marginal.low:.3g} to {marginal.high:.3g})")
            for marginal in calibrated.marginals
        ],
        sections=[*sections, _gates(calibrated)],
    )


def _levels(calibrated: Calibrated, prediction: Prediction, number: int) -> Section:
    used = (
        "The settings were fitted to these readings, so this error is the residual of the fit, not a test."
        if prediction.role == "calibrated"
        else "No setting was fitted to these readings, so this is a prediction."
    )
    mark = "EMULATED " if calibrated.emulated and prediction.data != "measured" else ""
    plot = Plot(
        f"levels-{number}",
        f"Readings ({prediction.data}) with their 95 % intervals, and the mean and 95 % band that the posterior "
        "predicts.",
        partial(draw_prediction, prediction, mark),
        {
            "s_mm": prediction.s_mm,
            "read_mm": prediction.read_mm,
            "reading_half_width_mm": prediction.error_mm,
            "predicted_mm": prediction.mean_mm,
            "band_half_width_mm": prediction.half_mm,
        },
    )
    return Section(f"{prediction.trial}: {prediction.role}", [prediction.coverage_sentence, used, plot])


@themed()
def draw_prediction(prediction: Prediction, mark: str = "") -> Figure:
    """Draw the readings over the band that the posterior predicts for them."""
    _, axes = wide_axes(3.8, face=True)
    draw_curve(
        axes,
        prediction.s_mm,
        prediction.mean_mm,
        "-",
        prediction.half_mm,
        0.25,
        "95 % band of a reading",
        color=SIMULATED,
        linewidth=2.2,
        label="predicted mean",
    )
    axes.errorbar(
        prediction.s_mm,
        prediction.read_mm,
        prediction.error_mm,
        color=MEASURED,
        linestyle="none",
        marker="o",
        markersize=3.5,
        elinewidth=1.2,
        label=f"{mark}readings, 95 %",
    )
    ends_mm = np.concatenate(
        [prediction.mean_mm - prediction.half_mm, prediction.mean_mm + prediction.half_mm, prediction.read_mm]
    )
    axes.set_ylim(ends_mm.min() - 0.5, max(ends_mm.max(), 0.0) + 0.5)
    axes.legend(loc="best")
    return label_axes(axes, ALONG, LEVEL, f"{printable(prediction.trial)}: {prediction.role}")


def _settings(calibrated: Calibrated, draws: Floats) -> Section:
    frees = [marginal.free for marginal in calibrated.marginals]
    ranges = [f"{free.low:g} to {free.high:g}" for free in frees]
    columns = [
        FigureColumn("setting", "free.label", name=""),
        FigureColumn("", "free.name", name="setting"),
        FigureColumn("range", ranges, name=""),
        FigureColumn("", "free.low", name="low"),
        FigureColumn("", "free.high", name="high"),
        FigureColumn("best", "best", DIGITS),
        FigureColumn("5 %", "low", DIGITS, "q05"),
        FigureColumn("95 %", "high", DIGITS, "q95"),
        FigureColumn("width over prior width", "width_over_prior", partial(percent, decimals=0), "width_over_prior"),
        FigureColumn("identified", "identified", setting_words, ""),
    ]
    caption = "The posterior of each free setting (bars) over its prior (line)."
    plot = Plot("marginals", caption, partial(draw_marginals, calibrated, draws))
    return Section(
        "Settings", [*calibrated.advice, plot, FigureTable("Free settings", "settings", columns, calibrated.marginals)]
    )


@themed()
def draw_marginals(calibrated: Calibrated, draws: Floats) -> Figure:
    """Draw the posterior of each free setting, (n, d) in the unit cube, as bars over its prior."""
    columns = min(len(calibrated.marginals), 3)
    lines = -(-len(calibrated.marginals) // columns)
    figure = wide_figure(2.6 * lines)
    edges = np.linspace(0, 1, BARS + 1)
    for number, marginal in enumerate(calibrated.marginals):
        axes, free = figure.add_subplot(lines, columns, number + 1), marginal.free
        density, _ = np.histogram(draws[:, number], edges, density=True)
        axes.stairs(density, free.values(edges), fill=True, color=SIMULATED, alpha=0.6)
        axes.axhline(1.0, color=INK, linewidth=1.2)
        axes.axvline(marginal.best, color=MEASURED, linewidth=1.4, linestyle="--")
        if free.logarithmic:
            axes.set_xscale("log")
            axes.minorticks_off()
        ticks = free.values(np.array([0.0, 0.5, 1.0]))
        axes.set_xticks(ticks, [f"{value:.2g}" for value in ticks])
        axes.set(xlim=(free.low, free.high), yticks=[])
        label_axes(axes, free.label, "", "identified" if marginal.identified else "not identified")
    return figure


def _gates(calibrated: Calibrated) -> Section:
    names, reaches = zip(*calibrated.reaches, strict=True)
    columns = [
        FigureColumn("trial", names),
        FigureColumn("residual (mm)", "residual_mm", "{:.2f}".format),
        FigureColumn("noise (mm)", "noise_mm", "{:.2f}".format),
        FigureColumn("components", "components"),
        FigureColumn("scatter of runs (mm)", calibrated.run_noise_mm, "{:.2f}".format),
        FigureColumn("possible", [setting_words(reach.possible) for reach in reaches]),
    ]
    sizes, discrepancy_mm = SMOOTH_ERRORS_MM, calibrated.discrepancy_mm
    sentences = [
        "Residual: the part of the readings that no combination of the runs fits. Noise: the standard uncertainty of a "
        "reading and of the components that are left out.",
        f"The error of the best setting within the ranges is {calibrated.least_implausibility:.2f} times what the "
        "uncertainty of readings, runs and emulator allows; above 1, no setting is possible.",
        "The intervals allow for smooth errors of readings and model together, which no setting describes and which "
        f"one profile cannot show: {sizes['common']:g} mm equal at all stations, {sizes['tilt']:g} mm of tilt at "
        f"either end, {sizes['smooth']:g} mm over {SMOOTH_LENGTH_MM:g} mm, and {sizes['ends']:g} mm at each end of the "
        "path, as standard uncertainties.",
    ]
    if discrepancy_mm is not None:
        sentences.append(f"Further error of the model, estimated from all trials together: {discrepancy_mm:.2f} mm.")
    return Section("Gates", [*sentences, FigureTable("Trials", "gates", columns, reaches)])
