"""What the uncertainty of a comparison is, as tables and sentences for a report; from its metrics alone."""

from typing import Any

import numpy as np

from validate.statements.table import Table
from validate.wording import percent, signed

INPUTS = {
    "speed_mm_s": ("the nozzle's speed", "mm/s"),
    "volume_ml": ("volume given", "ml"),
    "start_mm": ("where the nozzle starts", "mm"),
    "width_mm": ("the crack's width", "mm"),
    "wall_angle_deg": ("the tilt of the walls", "°"),
    "depth_mm": ("the crack's depth", "mm"),
    "viscosity_percent": ("viscosity", "%"),
    "yield_stress_pa": ("yield stress", "Pa"),
    "station_mm": ("the stations' s", "mm"),
}
"""In words, by their names in [uncertainty]."""


def uncertainty_tables(metrics: dict[str, Any]) -> list[Table]:
    """Empty where the comparison was not assessed."""
    found = metrics.get("uncertainty")
    if found is None:
        return []
    tables = [_result(found), _readings(found), _alignment(found)]
    if found["numerics"] is not None:
        tables.append(_numerics(found["numerics"]))
    if found["inputs"]:
        tables.append(_inputs(found))
    return tables


def uncertainty_sentences(metrics: dict[str, Any]) -> list[str]:
    """What may be said, and what is not in it."""
    found = metrics.get("uncertainty")
    if found is None:
        return []
    sentences = [*found["sentences"], *found["readings"]["cautions"]]
    if found["inputs_left_out"]:
        names = ", ".join(INPUTS[name][0] for name in found["inputs_left_out"])
        sentences.append(f"Not declared in [uncertainty], and not included: {names}.")
    if found["numerics"] is None:
        sentences.append(
            "How much hangs on the particles' size, and on the inputs, was not examined: 'sealtwin validate RUN "
            "--uncertainty' does."
        )
    return [
        *sentences,
        "All intervals are of the levels at the stations: between them both the readings and the true level are taken "
        "for straight.",
    ]


def volume_rows(metrics: dict[str, Any]) -> list[tuple[str, str]]:
    """The readings' own side of the mass balance, and the volumes' baseline; empty where it was not assessed."""
    balance = metrics.get("mass_balance")
    if balance is None:
        return []
    cured = (
        "state not declared, shrinkage not corrected"
        if balance["readings_state"] is None
        else "read wet"
        if balance["readings_state"] == "wet"
        else "cured, shrinkage not declared and not corrected"
        if balance["shrinkage_percent"] is None
        else f"cured, {balance['readings_when_dispensed_mm3']:.0f} mm³ before {balance['shrinkage_percent']:g} % of "
        "shrinkage"
    )
    beats = "the simulation beats it" if metrics["beats_volume_balance"] else "the simulation does NOT beat it"
    return [
        ("dispensed", f"{balance['dispensed_mm3']:.0f} mm³"),
        ("simulated: in the crack, below the face", f"{balance['in_crack_mm3']:.0f} mm³"),
        ("simulated: above the face", f"{balance['above_mm3']:.0f} mm³"),
        ("simulated: over the sample's edge", f"{balance['spilled_mm3']:.0f} mm³"),
        ("lost by the numbers (below 0: gained)", f"{balance['lost_mm3']:.0f} mm³"),
        ("face beside the mouth under sealant", f"{balance['footprint_mm2']:.0f} mm²"),
        ("held by the readings, over the covered length", f"{balance['readings_mm3']:.0f} mm³ ({cured})"),
        (
            "share of the cavity filled, over the covered length",
            f"{percent(metrics['simulated_fill_ratio'])} simulated, {percent(metrics['measured_fill_ratio'])} measured",
        ),
        (
            "level of the volume spread over the nozzle's reach, as a baseline",
            f"{metrics['volume_balance_level_mm']:.2f} mm, mean error {metrics['volume_balance_error_mm']:.3f} mm: "
            f"{beats}",
        ),
    ]


def _result(found: dict[str, Any]) -> Table:
    low_mm, high_mm = found["mean_error_mm"]
    bias_low_mm, bias_high_mm = found["bias_mm"]
    mean = found["mean_level"]
    stations = found["stations"]
    resolved = np.abs(stations["error_mm"]) > 2 * np.asarray(stations["validation_mm"])
    band_mm = np.asarray(found["levels"]["band_95_mm"])
    return Table(
        "What may be said of the error",
        (
            ("mean error, 95 % by the readings' doubt", f"{low_mm:.3f} to {high_mm:.3f} mm"),
            ("bias, 95 % by the readings' doubt", f"{signed(bias_low_mm, 3)} to {signed(bias_high_mm, 3)} mm"),
            ("of it, what more stations would not make smaller", f"{found['bias_systematic_mm']:.3f} mm (1 sd)"),
            ("95 % band of a station's level, by all that is known of the readings", f"± {_span(band_mm)} mm"),
            ("E, of the mean level: simulated - measured", f"{signed(mean['error_mm'], 3)} mm"),
            ("u of the readings, in it", f"{mean['data_mm']:.3f} mm"),
            ("u of the numerics", _or_not(mean["numerics_mm"])),
            ("u of the inputs", _or_not(mean["inputs_mm"])),
            ("u_val, all of them together", f"{mean['validation_mm']:.3f} mm"),
            ("|E| above 2 u_val", "yes" if mean["resolved"] else "no"),
            ("stations with |E| above 2 u_val", f"{int(resolved.sum())} of {len(resolved)}"),
        ),
    )


def _readings(found: dict[str, Any]) -> Table:
    readings = found["readings"]
    rows = []
    for part in readings["parts"]:
        freedom = part.get("freedom")
        known = f", {freedom:.0f} degrees of freedom" if freedom is not None and np.isfinite(freedom) else ""
        whose = "shared by all stations" if part["shared"] else "each station's own"
        rows.append((part["name"], f"{part['standard_mm']:.4f} mm (1 sd), {part['shape']}{known}; {whose}"))
    if readings["bartlett_p"] is not None:
        pooled = "pooled" if readings["pooled"] else "NOT pooled"
        text = f"p = {readings['bartlett_p']:.2g}: {pooled} in mean error and bias"
        text += "; in a station's band its own repeats are weighed with those of all the others"
        rows.append(("Bartlett's test of equal scatter", text))
    return Table("Budget of the readings", tuple(rows))


def _alignment(found: dict[str, Any]) -> Table:
    rows = [("choice", found["alignment"]["choice"])]
    rows += [
        (
            f"readings moved by {row['shift_mm']:+g} mm" if row["shift_mm"] else "as chosen",
            f"mean error {row['mean_error_mm']:.3f} mm, bias {signed(row['bias_mm'], 3)} mm",
        )
        for row in found["alignment"]["shifts"]
    ]
    return Table("Where s is 0", tuple(rows))


def _numerics(numerics: dict[str, Any]) -> Table:
    rows = [("radius of the particles", ", ".join(f"{radius:.3g}" for radius in numerics["radii_mm"]) + " mm")]
    for name, key in (("mean level", "mean_level_mm"), ("mean error", "mean_error_mm")):
        one = numerics[key]
        values = ", ".join(f"{value:.3f}" for value in one["values"])
        if one["kind"] == "converging":
            how = f"converging, observed order {one['order']:.1f}: ± {one['band']:.3f} mm by the convergence index"
        else:
            how = f"{one['kind']}: ± {one['band']:.3f} mm, the spread of the three"
        rows.append((name, f"{values} mm; {how}"))
    return Table("Particle size", tuple(rows))


def _inputs(found: dict[str, Any]) -> Table:
    rows = []
    for one in found["inputs"]:
        name, unit = INPUTS[one["name"]]
        does = f"mean level {signed(one['mean_level_mm'], 3)} mm, at most {one['largest_mm']:.2f} mm somewhere"
        rows.append((f"{name}, by {one['standard']:g} {unit}", does))
    if found["effect_scatter_mm"] is not None:
        rows.append(("the same by the scatter of single runs", f"{found['effect_scatter_mm']:.2f} mm at a place"))
    return Table("Inputs, one standard uncertainty up", tuple(rows))


def _or_not(value_mm: float | None) -> str:
    return "not determined" if value_mm is None else f"{value_mm:.3f} mm"


def _span(values: np.ndarray) -> str:
    low, high = f"{values.min():.3f}", f"{values.max():.3f}"
    return low if low == high else f"{low} to {high}"
