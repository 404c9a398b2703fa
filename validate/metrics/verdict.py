"""The verdict on a comparison, and the minimum of readings that it needs."""

import math
from collections.abc import Sequence

import numpy as np

from sealtwin.core.facts import Fact, doubt
from sealtwin.core.records import Floats
from validate.comparison import Basis, ErrorUncertainty, LevelMetrics
from validate.metrics.baselines import against_baselines
from validate.result import Comparison, Outcome
from validate.settings import Gate
from validate.units import counted, setting_name

FEWEST_STATIONS = 7
"""Smallest number of stations. Beside a mound where the nozzle stops, the interval of the bias contains the truth in 0
to 98 % of trials with 5 stations, 90 % or more with 6, and 94 % or more with 7."""
LEAST_COVERAGE = 0.8
"""Least covered share of the crack's length: a tenth at each end may be out of a caliper's reach. The paper's worst
errors are at the ends."""
WIDEST_GAP = 0.3
"""Largest distance of neighbouring stations, as a share of the crack's length. Stations placed by hand are uneven.
A cluster and one far away leave a wider gap."""
NEARLY_ALL = 0.95  # Coverage below which the verdict states it
ROUNDING = 1e-9
BASELINES, SCREENING = "verdict.baselines", "verdict.screening"
"""Keys of a headline with a valid mean error, and of one by the fast model."""
NO_VERDICT = "No verdict: the level was computed by the fast model, which is for screening."
SOUND = (0.95, 1.05)
"""Sound range of the volume ratio, which is settled over dispensed volume. The preset "accurate" stays within it."""


def kept_volume(ratio: float) -> bool:
    """Return True if the volume ratio, rounded as printed, is within ``SOUND``."""
    low, high = SOUND
    return low <= round(ratio, 3) <= high


def basis_of(s_mm: Floats, from_mm: float, to_mm: float, length_mm: float) -> Basis:
    """Return number, coverage and largest gap of sorted stations that are compared from ``from_mm`` to ``to_mm``."""
    first = max(0, int(np.searchsorted(s_mm, from_mm, side="right")) - 1)
    last = min(len(s_mm) - 1, int(np.searchsorted(s_mm, to_mm, side="left")))
    used_mm = s_mm[first : last + 1]
    gap = float(np.diff(np.clip(used_mm, from_mm, to_mm)).max()) / length_mm
    coverage = (to_mm - from_mm) / length_mm
    enough = len(used_mm) >= FEWEST_STATIONS and coverage >= LEAST_COVERAGE - ROUNDING and gap <= WIDEST_GAP + ROUNDING
    return Basis(stations_used=len(used_mm), coverage=coverage, widest_gap_mm=gap * length_mm, enough_readings=enough)


def judged(
    metrics: LevelMetrics,
    gate: Gate | None = None,
    uncertainty: ErrorUncertainty | None = None,
    edited: tuple[str, ...] = (),
    *,
    screening: bool = False,
) -> Comparison:
    """Return the metrics with their headline: baselines, use of the readings, and the declared limit.

    ``edited`` are files of the run that were changed after their stage wrote them. With such files, an escaped particle
    or a model for ``screening`` there is no verdict. ``passed`` compares the mean error with the limit. ``outcome``
    compares its 95 % interval, which is due to the readings.
    """
    # Unused declarations are reported with any verdict.
    m, findings = metrics, () if uncertainty is None else uncertainty.unused
    covers = f"cover {math.floor(100 * m.coverage + ROUNDING)} % of the crack's length"
    passed, outcome = None if gate is None else False, "undecided"
    if m.escaped_particles:
        passed, outcome = False, "failed"
        text = f"{leak(m.escaped_particles)}: the mean error of {m.mean_error_mm:.3f} mm is invalid."
        headline = (Fact("verdict.leak", text, m.escaped_particles, level="fault"),)
    elif edited:
        headline = (Fact("verdict.edited", f"{edited_by_hand(edited)}: no verdict.", len(edited), level="fault"),)
    elif screening:
        passed, outcome = None, "open"
        not_judged = "" if gate is None else f" The gate of {gate.mean_error_mm:g} mm is not applied."
        headline = (
            doubt(SCREENING, NO_VERDICT + not_judged),
            Fact("verdict.mean-error", f"Mean error {_with_interval(m, uncertainty)}.", m.mean_error_mm, "mm"),
            *_with_figures(m),
        )
        gate = None
    elif not m.enough_readings:
        outcome = "open" if gate is None else "undecided"
        why = (
            f"No verdict: the readings {covers} ({_stations(m)}, with gaps of up to "
            f"{100 * m.widest_gap_mm / m.length_mm:.0f} %). Read at least {100 * LEAST_COVERAGE:.0f} % of it, at "
            f"{FEWEST_STATIONS} stations or more (fewer miss a mound), with gaps of at most {100 * WIDEST_GAP:.0f} %."
        )
        headline = doubt("verdict.too-few-readings", why), _role(m)
    else:
        passed, outcome, first = _against_gate(m, gate, uncertainty)
        first += f" The readings {covers}." if m.coverage < NEARLY_ALL else ""
        headline = *_with_figures(m), Fact("verdict.gate", first, m.mean_error_mm, "mm")
        findings = () if uncertainty is None else uncertainty.findings
    # The metrics were validated before.
    return Comparison.model_construct(
        **dict(m),
        headline=headline,
        outcome=outcome,
        passed=passed,
        gate=gate,
        findings=findings,
        uncertainty=uncertainty,
    )


def _with_figures(m: LevelMetrics) -> tuple[Fact, Fact]:
    return Fact(BASELINES, beside_baselines(m), m.mean_error_mm, "mm"), _role(m)


def _role(m: LevelMetrics) -> Fact:
    return Fact("verdict.role", use_of_readings(m), m.role)


def _stations(m: LevelMetrics) -> str:
    """Return the number of compared stations, and of stations beyond the stretch that define the measured line."""
    beyond = m.stations_used - m.stations_compared
    return counted(m.stations_compared, "station") + (f" and {beyond} beyond them" if beyond else "")


def _with_interval(m: LevelMetrics, uncertainty: ErrorUncertainty | None) -> str:
    if uncertainty is None:
        return f"{m.mean_error_mm:.2f} mm"
    low_mm, high_mm = uncertainty.mean_error_interval_mm
    unknown = "" if uncertainty.budget.scatter_known else ", whose scatter is unknown"
    return f"{m.mean_error_mm:.2f} mm (95 % interval {low_mm:.2f} to {high_mm:.2f} mm, from the readings{unknown})"


def _against_gate(
    m: LevelMetrics, gate: Gate | None, uncertainty: ErrorUncertainty | None
) -> tuple[bool | None, Outcome, str]:
    """Return whether the mean error is within the gate, the outcome, and the sentence on both."""
    figures = f"mean error {_with_interval(m, uncertainty)}"
    if gate is None:
        return None, "open", f"No gate is declared: {figures}."
    passed = m.mean_error_mm <= gate.mean_error_mm
    reason = f"reason: {gate.reason}" if gate.reason else "no reason is given"
    figures += f", limit {gate.mean_error_mm:g} mm ({reason})"
    low_mm, high_mm = (math.inf, 0.0) if uncertainty is None else uncertainty.mean_error_interval_mm
    if low_mm <= gate.mean_error_mm <= high_mm:
        return passed, "undecided", f"Gate undecided: {figures}; the limit is inside the interval."
    return passed, "passed" if passed else "failed", f"Gate {'passed' if passed else 'failed'}: {figures}."


def beside_baselines(m: LevelMetrics) -> str:
    """Return the sentences that compare the mean error with those of the baselines."""
    fitted = None if m.fitted is None else len(m.fitted)
    return against_baselines(m.mean_error_mm, m.baselines, m.role, fitted, m.stations_compared)


def use_of_readings(m: LevelMetrics, *, in_full: bool = True) -> str:
    """Return the sentence on the earlier use of the readings, and on a sample that was not measured.

    Fitted settings are named if ``in_full``, and counted otherwise.
    """
    sentence = _role_sentence(m, in_full=in_full)
    if m.readings_data != "measured" or m.photo_data == "measured":
        return sentence
    return f"{sentence} The sample is {'of undeclared origin' if m.photo_data == 'undeclared' else m.photo_data}."


def _role_sentence(m: LevelMetrics, *, in_full: bool) -> str:
    readings = "readings" if m.readings_data == "measured" else f"{m.readings_data} readings"
    if m.role == "calibrated-on":
        if m.fitted == ():
            return f"Calibrated on these {readings}, with no fitted setting as declared: not a test."
        if m.fitted and not in_full:
            return f"Fitted to these {readings} ({counted(len(m.fitted), 'setting')}): not a test."
        what = "the fitted settings are not declared"
        if m.fitted:
            count = counted(m.stations_compared, "station")
            what = f"fitted at {count}: {', '.join(map(setting_name, m.fitted))}"
        return f"Calibrated on these {readings} ({what}), so this error is the residual of the fit, not a test."
    if m.role == "held-out":
        return f"Held out, as declared: no setting was fitted to these {readings}."
    return f"The use of these {readings} is not declared: set readings.role."


def edited_by_hand(names: Sequence[str]) -> str:
    """Return the beginning of a sentence about results that were edited after their stage wrote them."""
    return f"Files were edited by hand after the run ({', '.join(names)})"


def leak(escaped_particles: int) -> str:
    """Return the beginning of a sentence about particles that passed through a wall."""
    return f"Do not use this run: {counted(escaped_particles, 'particle')} went through a wall"
