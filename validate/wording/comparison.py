"""Tables and sentences on the agreement with the readings, the volumes and their uncertainty."""

from itertools import groupby

import numpy as np

from sealtwin.core.records import Profile
from validate.comparison import (
    Baseline,
    BudgetPart,
    ErrorUncertainty,
    MassBalance,
    StationError,
    StationErrors,
    VolumeComparison,
)
from validate.report_input import Evidence, ReadingsSheet
from validate.result import Comparison
from validate.uncertainty.budget import UNDECLARED_MM
from validate.units import (
    MODELS,
    NOT_COMPUTED,
    NOT_RECORDED,
    PageTable,
    counted,
    percent,
    signed,
    span,
)
from validate.wording.prediction import INPUTS, input_sentences, prediction_sentences

NAMED = 3  # Most stretches that the sentence names, the largest errors first
AT_A_STATION_MM = 0.05  # Distance up to which an error is at a station; s is printed to 0.1 mm


def balance_table(evidence: Evidence) -> PageTable:
    """Return the table of the dispensed sealant's volume at each place."""
    run, rows = evidence.run, []
    for label, volume_mm3 in volumes_mm3(evidence).values():
        particles = f", {counted(round(volume_mm3 / run.particle_volume_mm3), 'particle')}" if run.has_particles else ""
        rows.append((label, f"{volume_mm3:.0f} mm³{particles}"))
    if run.has_particles:
        rows.append(("space that the settled particles fill, over dispensed volume", f"{evidence.volume_ratio:.3f}"))
    else:
        rows += [(place, NOT_COMPUTED) for place in ("over the edge of the sample", "through a wall")]
    return PageTable("Dispensed sealant, by place", tuple(rows))


def volumes_mm3(evidence: Evidence) -> dict[str, tuple[str, float]]:
    """Return label and volume of the dispensed sealant at each place, by the key in report.json."""
    run = evidence.run
    if (filled := run.fast_fill) is not None:
        return {
            "dispensed": ("dispensed", filled.dispensed_mm3),
            "in_crack": ("dispensed sealant below the face's plane", filled.in_crack_mm3),
            "above_face": ("dispensed sealant above the face's plane", filled.above_face_mm3),
            "in_flight": ("dispensed sealant that has not landed yet", filled.in_flight_mm3),
        }
    height_mm = run.position_mm[~run.spilled, 2]
    counts = {
        "dispensed": ("dispensed", len(run.position_mm)),
        "in_crack": ("in the crack: centres at or below the face", int((height_mm <= 0).sum())),
        "above_face": (
            "above the face: over the mouth, beside it and in the jet",
            int((height_mm > 0).sum()),
        ),
        "spilled": ("over the edge of the sample", run.spilled_particles),
        "escaped": ("escaped through a wall (must be 0)", run.escaped_particles),
    }
    return {key: (label, count * run.particle_volume_mm3) for key, (label, count) in counts.items()}


def agreement_table(comparison: Comparison) -> PageTable:
    """Return the table of the error's metrics and of the baselines."""
    m = comparison
    stretch = f"({m.covered_from_mm:.1f} to {m.covered_to_mm:.1f} mm)"
    room = f"{m.simulated_underfill_mm3:.0f} mm³ simulated, {m.measured_underfill_mm3:.0f} mm³ measured"
    heap = f"{m.simulated_overfill_mm3:.0f} mm³ simulated, {m.measured_overfill_mm3:.0f} mm³ measured"
    rows = (
        ("covered length", f"{m.covered_length_mm:.1f} mm, {percent(m.coverage)} of the crack {stretch}"),
        ("area between the curves", f"{m.area_mm2:.4f} mm²"),
        ("mean error = area / covered length", f"{m.mean_error_mm:.3f} mm"),
        ("bias (simulated - measured)", f"{signed(m.bias_mm, 3)} mm"),
        ("root mean square error", f"{m.rmse_mm:.3f} mm"),
        ("95 % of the length within", f"{m.p95_error_mm:.3f} mm"),
        ("Fréchet distance", f"{m.frechet_mm:.3f} mm"),
        ("length with less than 1 mm error", percent(m.share_under_1_mm)),
        ("room between level and mouth, over the covered length", room),
        ("heap between mouth and level, over the covered length", heap),
    )
    return PageTable("Agreement with the readings", rows)


def _baseline(one: Baseline, error_mm: float) -> str:
    """Return a baseline's error. If both errors are equal, the baseline wins: it needs no simulation."""
    beats = "the simulation beats it" if error_mm < one.mean_error_mm else "the simulation does NOT beat it"
    fitted = f", {counted(one.numbers, 'number')} fitted to the readings" if one.numbers else ""
    return f"mean error {one.mean_error_mm:.3f} mm{fitted}: {beats}"


def readings_table(readings: Profile, comparison: Comparison, sheet: ReadingsSheet | None) -> PageTable:
    """Return the table of the readings: their file, format and scatter."""
    m, scatter = comparison, comparison.scatter
    rows = [("source", readings.source)]
    if sheet is not None:
        named = (("file", sheet.name), ("read by", sheet.operator), ("read on", sheet.date))
        rows = [(label, text) for label, text in named if text]
    if readings.dialect:
        rows.append(("read as", readings.dialect))
    means = readings.understood.means if readings.understood else ()
    rows += [(mean.quantity, f"{mean.value:.4g} {mean.unit or '(no unit)'}, mean of {mean.numbers}") for mean in means]
    rows += [("in doubt", doubt) for doubt in readings.doubts]
    stations = f"{m.stations_compared} of {scatter.stations}, at most {m.widest_gap_mm:.1f} mm from one to the next"
    rows += [
        ("data", readings.data),
        ("stations, readings", f"{scatter.stations}, {scatter.readings}"),
        ("stations compared", stations),
    ]
    if scatter.repeatability_sd_mm is None:
        rows.append(("repeatability", "unknown, since no station was read twice"))
    else:
        freedom = f"{counted(scatter.degrees_of_freedom, 'degree')} of freedom"
        deviation = f"{scatter.repeatability_sd_mm:.3f} mm standard deviation, {freedom}"
        rows.append(("repeatability, pooled over the stations", deviation))
    return PageTable("Readings", tuple(rows))


Rows = list[tuple[str, str]]
FAST_INPUTS = "In cases that were also run with particles, u_input agreed within a factor of 1.25."


def uncertainty_sentences(evidence: Evidence) -> tuple[str, ...]:
    """Return sentences on the uncertainty, without the findings; one sentence if it was not assessed."""
    comparison = evidence.comparison
    if evidence.prediction is not None:
        return prediction_sentences(evidence.prediction)
    if comparison is not None and comparison.uncertainty is not None:
        return tuple(_included(comparison.uncertainty))
    run = (
        f"with particles of {evidence.run.radius_mm:g} mm radius" if evidence.run.has_particles else "of the fast model"
    )
    what = "this is a single run" if evidence.seeds is None else f"these are {len(evidence.seeds.seeds)} runs"
    scatter = "" if evidence.seeds is None else ", whose band shows their scatter alone"
    sentence = f"The uncertainty is not assessed: {what} {run}{scatter}."
    if evidence.readings is not None or not evidence.extra_runs:
        return (sentence,)
    return (f"{sentence} Compute its band with 'sealtwin validate RUN --uncertainty' (about {evidence.extra_runs}).",)


def _included(uncertainty: ErrorUncertainty) -> list[str]:
    """Return sentences on the result of the comparison and on what the intervals do not include."""
    conclusion, *_ = uncertainty.sentences
    sentences = [conclusion, *uncertainty.unused, *uncertainty.budget.notes]
    if not uncertainty.budget.scatter_known:
        sentences.append(
            "The scatter of the readings is not included: no station was read twice, and uncertainty.repeatability_mm "
            "is not declared."
        )
    if (draws := uncertainty.input_draws) is not None:
        sentences.append(
            f"The fast model computed the effect of the inputs: {counted(draws.runs, 'run')} with random inputs, each "
            f"minus the run with the declared inputs. Only these differences are used. {FAST_INPUTS}"
        )
    # The intervals of the error are by the readings alone; the inputs are part of u_val.
    return sentences + input_sentences(uncertainty.inputs_left_out, () if draws is None else draws.unfit, "u_val")


def volume_table(metrics: Comparison, volumes: VolumeComparison) -> PageTable:
    """Return the table of the mass balance, of the volume below the readings, and of the dispensed volume's level."""
    balance = volumes.mass_balance
    state, _ = sealant_as_read(balance)
    filled = f"{percent(metrics.simulated_fill_ratio)} simulated, {percent(metrics.measured_fill_ratio)} measured"
    level_mm, error_mm = volumes.volume_balance_level_mm, volumes.volume_balance_error_mm
    baseline = f"{level_mm:.2f} mm, {_baseline(Baseline('', 0, error_mm), metrics.mean_error_mm)}"
    settled_mm3 = balance.in_crack_mm3 + balance.above_mm3
    read_off = f"{percent(metrics.simulated_sealant_mm3 / settled_mm3)} of the settled space" if settled_mm3 else "none"
    rows = (
        ("face beside the mouth under sealant", f"{balance.footprint_mm2:.0f} mm²"),
        (
            "sealant under the level, over the covered length",
            f"{metrics.simulated_sealant_mm3:.0f} mm³ simulated ({read_off}), {balance.readings_mm3:.0f} mm³ measured "
            f"({state})",
        ),
        ("share of the cavity filled, over the covered length", filled),
        ("level of the dispensed volume, flat in the whole crack, as a baseline", baseline),
    )
    return PageTable("Volume of the settled sealant, and by the readings", rows)


def sealant_as_read(balance: MassBalance) -> tuple[str, str]:
    """Return the declared state of the sealant when it was read, for a table and for the end of a sentence on curing.

    Cured sealant has shrunk; the simulated sealant has not.
    """
    if balance.readings_state is None:
        undeclared = "; whether the caliper read wet or cured sealant is not declared (readings.state)"
        return "state not declared, shrinkage not corrected", undeclared
    if balance.readings_state == "wet":
        return "read wet", ", and the caliper read wet sealant, which had not shrunk"
    if balance.shrinkage_percent is None:
        undeclared = "whose shrinkage is not declared (readings.shrinkage_percent)"
        return (
            "cured, shrinkage not declared and not corrected",
            f", while the caliper read cured sealant, {undeclared}",
        )
    return (
        f"cured, {balance.readings_when_dispensed_mm3:.0f} mm³ before its shrinkage of {balance.shrinkage_percent:g} %",
        f", while the caliper read cured sealant: the mass balance adds its shrinkage of {balance.shrinkage_percent:g} "
        "%, the levels do not",
    )


def uncertainty_tables(uncertainty: ErrorUncertainty) -> list[PageTable]:
    """Return the tables of the intervals, the error budget, the alignment, the particle size and the inputs."""
    tables = {
        "Error and its uncertainty": _result(uncertainty),
        "Budget: u of the mean level, of the mean error and of a station, by each error alone": _budget(uncertainty),
        f"Not declared, in no interval: the same for {UNDECLARED_MM:g} mm, or for the size in a name": _missing(
            uncertainty
        ),
        "Convention for s = 0": _alignment(uncertainty),
        "Particle size": _numerics(uncertainty),
        "Inputs, each raised by one standard uncertainty": _inputs(uncertainty),
    }
    return [PageTable(title, tuple(rows)) for title, rows in tables.items() if rows]


def _result(uncertainty: ErrorUncertainty) -> Rows:
    bias_low_mm, bias_high_mm = uncertainty.bias_interval_mm
    mean, stations, levels = uncertainty.mean_level, uncertainty.stations, uncertainty.levels
    volume = NOT_RECORDED if mean.volume_level_mm is None else f"{signed(mean.volume_level_mm, 3)} mm"
    count, validated = len(stations.error_mm), []
    if mean.resolved is not None:
        validated = [
            ("u_val, these three together", f"{mean.validation_mm:.3f} mm"),
            ("|E| above 2 u_val; if not, simulation and readings are consistent", "yes" if mean.resolved else "no"),
        ]
    return [
        ("bias, 95 % interval from the readings", f"{signed(bias_low_mm, 3)} to {signed(bias_high_mm, 3)} mm"),
        ("u of the bias due to errors that all stations share", f"{uncertainty.bias_systematic_mm:.3f} mm (1 sd)"),
        ("95 % band of one station's level, from the readings", f"± {span(levels.band_95_mm, 3)} mm"),
        ("95 % band of all stations' levels together", f"± {span(levels.profile_band_95_mm, 3)} mm"),
        ("part of the bias due to volume gained by the numerics (negative: lost)", volume),
        ("u of the mean level due to the readings", f"{mean.data_mm:.3f} mm"),
        *(
            (f"u of the mean level due to the {name}", f"{size_mm:.3f} mm")
            for name, size_mm in (("numerics", mean.numerics_mm), ("inputs", mean.inputs_mm))
            if size_mm is not None
        ),
        *validated,
        ("stations outside the band of all stations", f"{int(stations.off.sum())} of {count}"),
        (
            "stations outside their own band",
            f"{int(stations.above.sum())} of {count}; about {stations.by_chance:.1f} by chance, if the level is right "
            "and the budget complete",
        ),
    ]


def _budget(uncertainty: ErrorUncertainty) -> Rows:
    return [(f"{one.name} ({one.source})", _part_size(one)) for one in uncertainty.budget.parts]


def _missing(uncertainty: ErrorUncertainty) -> Rows:
    return [(f"{one.name} ({one.setting})", _part_size(one)) for one in uncertainty.budget.missing]


def _part_size(one: BudgetPart) -> str:
    return f"{one.mean_level_mm:.3f}, {one.mean_error_mm:.3f}, {one.station_mm:.3f} mm"


def _alignment(uncertainty: ErrorUncertainty) -> Rows:
    moved = [row for row in uncertainty.alignment.shifts if row.shift_mm]
    shifts = ", ".join(f"{row.shift_mm:+g}" for row in moved)
    errors = ", ".join(f"{row.mean_error_mm:.2f}" for row in moved)
    return [
        ("choice", uncertainty.alignment.choice),
        (f"mean error with the readings moved by {shifts} mm", f"{errors} mm"),
    ]


def _numerics(uncertainty: ErrorUncertainty) -> Rows:
    if (study := uncertainty.numerics) is None:
        return []
    radii = ", ".join(f"{radius_mm:.3g}" for radius_mm in study.radii_mm)
    runs = ", ".join(map(str, study.mean_level_mm.runs))
    rows = [("radius of the particles", f"{radii} mm, in {runs} runs that differ in seed")]
    for name, one in (("mean level", study.mean_level_mm), ("mean error", study.mean_error_mm)):
        values = ", ".join(f"{value_mm:.3f}" for value_mm in one.values)
        low, high = one.order_95
        band = f"± {one.band:.3f} mm at 95 %, order of convergence {low:.1f} to {high:.1f}"
        rows.append((name, f"{values} mm; {band}; a run scatters by {one.scatter:.3f} mm"))
    return rows


def _inputs(uncertainty: ErrorUncertainty) -> Rows:
    rows = []
    for one in uncertainty.inputs:
        name, unit = INPUTS[one.name]
        does = f"mean level {signed(one.mean_level_mm, 3)} mm, largest change {one.largest_mm:.2f} mm"
        share = f"{percent(one.share)} of the variance of u_input"
        rows.append((f"{name}, by {one.standard:g} {unit}", f"{does}; {share}, {MODELS[one.model]}"))
    if uncertainty.input_draws is not None:
        rows.append(
            ("inputs in combination", f"{percent(uncertainty.input_draws.together)} of the variance of u_input")
        )
    if uncertainty.inputs and uncertainty.effect_scatter_mm is not None:
        rows.append(
            ("change due to the scatter of single runs alone", f"{uncertainty.effect_scatter_mm:.2f} mm at a place")
        )
    return rows


def worst_at_a_station(stations: StationErrors, worst_at_mm: float) -> StationError | None:
    """Return the largest error at a station, or None if the largest error of all is at a station or there are none."""
    if not len(stations.s_mm) or np.abs(stations.s_mm - worst_at_mm).min() < AT_A_STATION_MM:
        return None
    worst = int(np.argmax(np.abs(stations.error_mm)))
    return StationError(abs(float(stations.error_mm[worst])), float(stations.s_mm[worst]))


def stretches_off(stations: StationErrors) -> tuple[str, ...]:
    """Return a sentence on stretches of stations that are outside the band on one side, if any, the worst first."""
    sides = np.where(stations.off, np.sign(stations.error_mm), 0).astype(int)
    stretches: list[tuple[float, str]] = []
    for side, group in groupby(range(len(sides)), key=lambda station: int(sides[station])):
        if side:
            part = list(group)
            worst = max(part, key=lambda station: abs(stations.error_mm[station]))
            off_mm = abs(float(stations.error_mm[worst]))
            first, last, at = (f"{stations.s_mm[station]:g}" for station in (part[0], part[-1], worst))
            place = f"from {first} to {last} mm (up to {off_mm:.1f} mm, at {at} mm)"
            if len(part) == 1:
                place = f"at {at} mm ({off_mm:.1f} mm)"
            stretches.append((off_mm, f"too {'high' if side > 0 else 'low'} {place}"))
    if not stretches:
        return ()
    named = [text for _, text in sorted(stretches, key=lambda stretch: -stretch[0])]
    others = len(named) - NAMED
    more = f"; {others} more {'stretch is' if others == 1 else 'stretches are'} outside by less" if others > 0 else ""
    return (
        f"Outside the 95 % band of all stations together, the simulated level is {', '.join(named[:NAMED])}{more}.",
    )
