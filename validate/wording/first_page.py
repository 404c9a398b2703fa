"""First page of a report in words: the verdict, two sentences, and four figures, for a reader who was not there."""

import numpy as np

from sealtwin.core.records import JsonRecord
from validate.metrics.baselines import are_compared
from validate.metrics.curve_distances import level_difference
from validate.report_input import Evidence
from validate.result import Comparison, PredictedLevel
from validate.units import counted, setting_name, signed
from validate.wording.comparison import volumes_mm3
from validate.wording.headline import faults, headline, not_measured
from validate.wording.of_runs import levels_in_words
from validate.wording.prediction import other_levels
from validate.wording.sample_and_run import freezing, hidden_width

ML = 1000.0  # mm³
MOST_NAMED = 6  # Most fitted settings that the page names
FLUSH_MM = 0.5  # Distance from the face up to which the level is called flush
AS_ABSENT = 0.05  # Error at a station that rounds to 0.1 mm


class ErrorBar(JsonRecord):
    """One line of a small bar chart."""

    name: str
    """The level that has this error."""
    error_mm: float
    """Mean error against the same readings."""
    own: bool
    """True for the simulation."""


class Tile(JsonRecord):
    """One of the four figures."""

    title: str
    """The question that it answers."""
    figure: str
    """The figure with its unit, or one word."""
    text: str
    """Its meaning, interval or parts, in a sentence or two."""
    bars: tuple[ErrorBar, ...] = ()
    """Errors to compare it with."""


class FirstPage(JsonRecord):
    """First page of the report, without its figure."""

    subject: str
    """Size of the crack and amount of sealant."""
    state: str
    """State of the verdict in a few words, with a mark."""
    verdict: str
    """The result in a sentence or two."""
    lead: tuple[str, ...]
    """Sentences on the line and the dots, and on where the line is off."""
    labels: tuple[tuple[str, str], ...]
    """Reservations: a word and a text."""
    tiles: tuple[Tile, ...]
    """The four figures."""
    notes: tuple[tuple[str, str], ...]
    """Sentences on what the level depends on, and the trial's note: a word and a text."""


def first_page(evidence: Evidence) -> FirstPage:
    comparison, prediction = evidence.comparison, evidence.prediction
    crack = evidence.outline
    volume = f"{evidence.run.dispensed_volume_mm3 / ML:.1f} ml of sealant"
    size = f"{crack.length_mm:.0f} mm long, {crack.mean_width_mm:.1f} mm wide, {evidence.solid.depth_mm:.3g} mm deep"
    if comparison is not None:
        fast = evidence.run.fast_fill is not None
        tiles = (
            _mean_error(comparison, fast=fast),
            _instead(comparison),
            _volumes(evidence),
            _tested(comparison, fast=fast),
        )
    elif prediction is not None:
        tiles = (
            *_predicted(prediction, levels_in_words(evidence.seeds, "simulation")),
            _volumes(evidence),
            _no_readings(evidence),
        )
    else:
        tiles = (*_alone(evidence), _volumes(evidence), _no_readings(evidence))
    return FirstPage(
        subject=f"crack {size}, {volume}",
        state=_state(evidence),
        verdict=_verdict(evidence),
        lead=_lead(evidence),
        labels=_labels(evidence),
        tiles=tiles,
        notes=_notes(evidence),
    )


def _state(evidence: Evidence) -> str:
    comparison, outcome = evidence.comparison, headline(evidence)[1]
    if evidence.edited:
        return "○ Files were edited by hand"
    if evidence.run.escaped_particles:
        return "✕ Fault: particles went through a wall"
    if comparison is None:
        return "○ Prediction, not measured yet" if evidence.prediction is not None else "○ Simulation alone"
    if evidence.run.fast_fill is not None:
        return "○ Fast model: no verdict"
    limit = "" if comparison.gate is None else f"{comparison.gate.mean_error_mm:g} mm"
    if outcome == "passed" and comparison.role == "calibrated-on":
        return "○ Fitted, not tested"
    words = {
        "passed": f"✓ Within its limit of {limit}",
        "failed": f"✕ Beyond its limit of {limit}",
        "undecided": f"○ Limit of {limit}: undecided" if limit else "○ No verdict",
    }
    return words.get(outcome, "○ No limit declared" if comparison.enough_readings else "○ Too few readings")


def _verdict(evidence: Evidence) -> str:
    comparison, prediction = evidence.comparison, evidence.prediction
    if evidence.edited:
        return "Files of this trial were edited by hand: the page shows them, and is no result."
    if evidence.run.escaped_particles:
        return "Particles went through a wall: a fault of the software, so the levels below are no result."
    if comparison is None:
        if prediction is None:
            return "The simulated fill, compared with nothing."
        low, high = prediction.mean_level_95_mm
        return (
            f"Predicted: a mean level {_from_face(prediction.mean_level_mm)}, give or take {(high - low) / 2:.1f} mm."
        )
    error = f"{comparison.mean_error_mm:.2f} mm"
    beyond = ""
    if comparison.outcome == "failed" and comparison.gate is not None:
        beyond = f", beyond the limit of {comparison.gate.mean_error_mm:g} mm"
    if not comparison.enough_readings:
        return f"Too few readings for a verdict; at these the simulation is {error} off."
    if evidence.run.fast_fill is not None:
        return f"The fast model, which is for screening, is {error} off the readings on average."
    if comparison.role == "held-out":
        return f"Tested: the simulation is {error} off readings that it has not seen{beyond}."
    if comparison.role == "calibrated-on":
        if beyond:
            return f"Although fitted to the readings, the simulation is {error} off{beyond}."
        return f"The simulation is {error} off the readings to which it was fitted. Not yet tested."
    return f"The simulation is {error} off the readings on average{beyond}."


def _lead(evidence: Evidence) -> tuple[str, ...]:
    volume = f"{evidence.run.dispensed_volume_mm3 / ML:.1f} ml of sealant"
    how = "fast model" if evidence.run.fast_fill is not None else "program"
    where = f"The line shows where the {how} computes that {volume} come to rest in this crack"
    if evidence.comparison is None:
        level = evidence.profile.level_mm
        low, high = _from_face(float(level.min())), _from_face(float(level.max()))
        return (
            f"The program pours {volume} into this crack; the line shows where the sealant comes to rest.",
            f"Along the crack its level is from {low} to {high}.",
        )
    return f"{where}; the dots are the readings.", _places(evidence, evidence.comparison)


def _places(evidence: Evidence, comparison: Comparison) -> str:
    """Return a sentence on where the level is off; for a missed limit, on whether level or shape is wrong."""
    readings = evidence.readings
    if readings is None:
        return ""
    error = level_difference(evidence.profile, readings)
    if comparison.outcome == "failed":
        bias_mm = comparison.bias_mm
        shape_mm = float(np.trapezoid(np.abs(error.value - bias_mm), error.x) / np.ptp(error.x))
        side = "high" if bias_mm > 0 else "low"
        check = "the caliper's zero and the dispensed volume"
        if shape_mm >= abs(bias_mm):
            check = "the sealant, the walls and the nozzle's path"
        return (
            f"The line is {abs(bias_mm):.1f} mm too {side} on average; with this shift removed, its mean error is "
            f"{shape_mm:.1f} mm. Check {check} first."
        )
    worst = int(np.argmax(np.abs(error.value)))
    if abs(error.value[worst]) < AS_ABSENT:
        return "It meets every reading."
    side, between = "high" if error.value[worst] > 0 else "low", ""
    if (station := comparison.worst_at_a_station) is not None:
        between = (
            f", between readings; at a reading it is off by at most {station.error_mm:.1f} mm, at {station.s_mm:.0f} mm"
        )
    return (
        f"The line is off most at {error.x[worst]:.0f} mm from the start, {abs(error.value[worst]):.1f} mm too {side}"
        f"{between}."
    )


def _labels(evidence: Evidence) -> tuple[tuple[str, str], ...]:
    """Return reservations; the cautions after the first follow below the page."""
    labels = [("Check first:", fault.text) for fault in faults(evidence)[:1]]
    if evidence.comparison is not None and not evidence.comparison.enough_readings:
        labels.append(("Verdict:", evidence.comparison.headline[0].text))
    if kinds := not_measured(evidence):
        labels.append(("Not a validation:", f"{', '.join(kinds)}."))
    return tuple(labels)


def _notes(evidence: Evidence) -> tuple[tuple[str, str], ...]:
    walls = [("Walls:", sentence) for sentence in hidden_width(evidence)]
    bed = [("Freezing:", sentence) for sentence in freezing(evidence)]
    material = evidence.run.settings["fluid"].get("material") or {}
    paste = [("Paste:", sentence) for sentence in material.get("doubts", ())]
    note = [("Note:", evidence.note)] if evidence.note else []
    better = evidence.comparison is None and evidence.can_be_planned
    plan = [("Next:", "'sealtwin plan trial.toml' searches for a flow that fills this crack better.")] if better else []
    return (*walls, *bed, *paste, *note, *plan)


def _mean_error(comparison: Comparison, *, fast: bool) -> Tile:
    parts = []
    if (interval_mm := comparison.interval_95_mm) is not None:
        parts.append("{:.2f} to {:.2f} mm by the errors of the readings, in 19 of 20 cases.".format(*interval_mm))
    if (gate := comparison.gate) is not None:
        parts.append(f"Limit {gate.mean_error_mm:g} mm: {gate.reason or 'no reason given'}.")
    else:
        parts.append("The fast model gets no verdict." if fast else "No limit was declared.")
    return Tile(title="Mean error", figure=f"{comparison.mean_error_mm:.2f} mm", text=" ".join(parts))


def _instead(comparison: Comparison) -> Tile:
    """Return the level without a simulation, of the fewest numbers, that is nearer; if none is nearer, the simplest."""
    fitted = len(set(comparison.fitted or ())) if comparison.role == "calibrated-on" else 0
    simulation = ErrorBar(name="simulation", error_mm=comparison.mean_error_mm, own=True)
    if not comparison.baselines:
        return Tile(title="Something simpler instead", figure="none", text="There is no simpler level to compare with.")
    nearer = [one for one in comparison.baselines if one.mean_error_mm <= comparison.mean_error_mm]
    shown = min(nearer or comparison.baselines, key=lambda one: (one.numbers, one.mean_error_mm))
    bars = [
        ErrorBar(name=one.name.removeprefix("a ").removeprefix("the "), error_mm=one.mean_error_mm, own=False)
        for one in comparison.baselines
    ]
    numbers = f", which has {counted(shown.numbers, 'number')}" if shown.numbers else ""
    text = f"Mean error of {shown.name}{numbers}."
    if fitted:
        text += f" The simulation has {counted(fitted, 'fitted setting')}."
    return Tile(
        title="Something simpler instead",
        figure=f"{shown.mean_error_mm:.2f} mm",
        text=text,
        bars=tuple(sorted([*bars, simulation], key=lambda bar: -bar.error_mm)),
    )


def _volumes(evidence: Evidence) -> Tile:
    ml = {place: volume_mm3 / ML for place, (_, volume_mm3) in volumes_mm3(evidence).items()}
    room_ml = evidence.solid.cavity_volume_mm3 / ML
    spilled = f", {ml['spilled']:.2f} ml ran over the sample's edge" if ml.get("spilled", 0.0) >= 0.005 else ""
    return Tile(
        title="Where the sealant goes" if evidence.comparison is None else "Where the sealant went",
        figure=f"{100 * ml['in_crack'] / room_ml:.0f} % full",
        text=f"{ml['in_crack']:.2f} of {ml['dispensed']:.2f} ml are in the crack, which holds {room_ml:.2f} ml; "
        f"{ml['above_face']:.2f} ml are above the face{spilled}.",
    )


def _tested(comparison: Comparison, *, fast: bool) -> Tile:
    title, readings = "Tested?", f"these readings at {counted(comparison.stations_compared, 'place')}"
    if comparison.role == "held-out":
        figure = "Fast model" if fast else "Yes"
        return Tile(title=title, figure=figure, text=f"No setting was fitted to {readings}: held out, as declared.")
    if comparison.role == "calibrated-on":
        if not comparison.fitted:
            text = "Settings were fitted to these readings; the trial does not name them."
            return Tile(title=title, figure="No", text=text)
        names = [setting_name(name) for name in dict.fromkeys(comparison.fitted)]
        more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        were = "was" if len(names) == 1 else "were"
        text = f"{counted(len(names), 'setting')} {were} fitted to {readings}: {', '.join(names[:MOST_NAMED])}{more}."
        return Tile(title=title, figure="No", text=text)
    text = f"The trial does not state whether settings were fitted to {readings}: set readings.role."
    return Tile(title=title, figure="Not declared", text=text)


def _predicted(prediction: PredictedLevel, levels: str) -> tuple[Tile, Tile]:
    low, high = (signed(value_mm, 2) for value_mm in prediction.mean_level_95_mm)
    half_mm = float(np.median(prediction.band_95_mm))
    return (
        Tile(
            title="Mean level, predicted",
            figure=f"{signed(prediction.mean_level_mm, 2)} mm",
            text=f"From the face; 19 of 20 {levels} have {low} to {high} mm.{other_levels(prediction)}",
        ),
        Tile(
            title="How sure at one place",
            figure=f"± {half_mm:.1f} mm",
            text=f"19 of 20 {levels}, at a typical place; ± {prediction.band_95_mm.max():.1f} mm at the least sure "
            "one. Errors of the readings come on top.",
        ),
    )


def _alone(evidence: Evidence) -> tuple[Tile, Tile]:
    s_mm, level_mm = evidence.profile.s_mm, evidence.profile.level_mm
    mean_mm = float(np.trapezoid(level_mm, s_mm) / np.ptp(s_mm))
    spans = {
        "below the face": level_mm < -FLUSH_MM,
        "flush": np.abs(level_mm) <= FLUSH_MM,
        "above it": level_mm > FLUSH_MM,
    }
    shares = ", ".join(f"{100 * float(np.mean(which)):.0f} % {name}" for name, which in spans.items())
    return (
        Tile(title="Mean level", figure=f"{signed(mean_mm, 2)} mm", text="From the face of the sample."),
        Tile(
            title="Low, flush, over",
            figure=f"{100 * float(np.mean(spans['flush'])):.0f} % flush",
            text=f"Of the crack's length {shares}, within {FLUSH_MM:g} mm.",
        ),
    )


def _no_readings(evidence: Evidence) -> Tile:
    if evidence.prediction is not None:
        text = "Archive this page before the pour, read the level afterwards, and compare: nothing was fitted to it."
        return Tile(title="Tested?", figure="Not yet", text=text)
    text = "Give [readings] of the sealed sample, and the page compares them with this level."
    return Tile(title="Compared?", figure="No", text=text)


def _from_face(level_mm: float) -> str:
    if round(level_mm, 1) == 0:
        return "at the face"
    return f"{abs(level_mm):.1f} mm {'above' if level_mm > 0 else 'below'} the face"


def station_rows(evidence: Evidence) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return the figure as a table: place, reading, its interval, simulated level and error at each station.

    Empty without readings; a station beyond the compared stretch has no error.
    """
    readings, comparison = evidence.readings, evidence.comparison
    if readings is None or comparison is None:
        return ()
    inside = are_compared(readings, comparison.covered_from_mm, comparison.covered_to_mm)
    level_mm = np.interp(readings.s_mm, evidence.profile.s_mm, evidence.profile.level_mm)
    uncertainty = comparison.uncertainty
    half_mm = None if uncertainty is None else uncertainty.levels.band_95_mm

    def row(values: object, shown: object = None) -> tuple[str, ...]:
        which = np.ones(len(readings.s_mm), dtype=bool) if shown is None else np.asarray(shown)
        return tuple(
            signed(float(value), 1) if there else "-" for value, there in zip(np.asarray(values), which, strict=True)
        )

    simulated, seeds = "simulated, mm", evidence.seeds
    if seeds is not None:
        simulated = f"mean of {len(seeds.seeds)} ± {seeds.band_95_mm:.1f}, mm"
    rows = [
        ("along, mm", tuple(f"{s_mm:.4g}" for s_mm in readings.s_mm)),
        ("read, mm", row(readings.level_mm)),
        (simulated, row(level_mm, inside)),
        ("error, mm", row(level_mm - readings.level_mm, inside)),
    ]
    if half_mm is not None:
        rows.insert(2, ("± in 19 of 20, mm", tuple(f"{value:.1f}" for value in half_mm)))
    return tuple(rows)
