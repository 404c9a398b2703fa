"""Determine a pump's flow and a paste's yield stress from a weighed and photographed bead on a plate."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import Field

from digitise.robots.cell import MISTYPED
from digitise.settings import OnFace, PhotoInput
from digitise.spread import MIDDLE, BeadOutline, measure_bead
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats
from sealtwin.material import MeasuredPaste, PasteOnPlate, PasteValue, by_source, four_digits, measured_material
from sealtwin.material.by_spread import DRAWS, NOT_FOR, SEED
from simulate.bead_law import STRETCH, PasteArea, laid_section, slumped_stress
from simulate.spread_law import GRAVITY_M_S2

MASS_ERROR_G = 0.03  # Standard uncertainty of the mass in g: scale steps of 0.05 g, and paste left on the nozzle
SPEED_ERROR = 0.005  # Relative standard uncertainty of a robot's speed on a straight line
LAW_ERROR = 0.057  # Relative standard uncertainty of the yield stress due to the law: RMS over simulated beads
SECTION = 0.03  # Relative standard uncertainty of the cross-section in the middle, from the same simulated beads
STIFFEST = 0.16
"""Largest yield stress that a bead shows, divided by rho g sqrt(A) (density, gravity, cross-section A).

A stiffer bead hardly flows."""
SHORTEST = (
    4.0  # Smallest length of a bead, divided by sqrt(A). In a shorter bead, paste flows from the middle to the ends
)
SOURCES = ("density", "mass", "scale", "edge", "surface tension", "law", "section", "speed")
END = 0.1  # Standard uncertainty of the position where a bead begins, divided by its width. Ends spread irregularly
BINS = 40  # Number of classes of the distance to the edge
MARK_WIDTHS = 0.5  # Largest distance between the start mark and the bead's line, divided by the bead's width
BEAD_NOT_FOR = (
    *NOT_FOR,
    "other flows than the flow of the bead: a pump requires repeated weighings at two or more flows",
)


class LaidBead(PasteOnPlate):
    """Settings of a bead that a robot's program laid: options of 'sealtwin material bead'."""

    mass_g: float = Field(gt=0, le=1e5)
    """Mass of the bead."""
    mass_error_g: float = Field(default=MASS_ERROR_G, gt=0, le=1e4)
    """Standard uncertainty of the mass."""
    asked_mm3_s: float = Field(ge=1e-3, le=1e6)
    """Flow that the program requested for the bead."""
    speed_mm_s: float = Field(ge=0.01, le=5000)
    """Speed of the nozzle that laid the bead."""
    start_mm: tuple[OnFace, OnFace] | None = None
    """Start of the nozzle's path, in mm from the lower left corner of the frame's opening. With it, the pump's delay is
    measured."""


@dataclass(frozen=True)
class BeadEstimate:
    stress_pa: PasteValue
    flow_mm3_s: PasteValue
    delay_s: PasteValue | None  # None if the start of the path is not given
    time_s: float  # Duration of dispensing
    section_mm2: float  # Cross-section in the middle of the bead
    stiffness: float  # Yield stress divided by rho g sqrt(A) (density, gravity, cross-section)
    parts_pa: dict[str, float]  # Standard uncertainty of the yield stress in Pa, by source

    def pump_row(self, laid: LaidBead) -> dict[str, float]:
        row = {"asked_mm3_s": laid.asked_mm3_s, "weighed_g": laid.mass_g, "time_s": four_digits(self.time_s)}
        return row if self.delay_s is None else {**row, "delay_s": four_digits(self.delay_s.value)}


def identify(laid: LaidBead, bead: BeadOutline) -> BeadEstimate:
    """Return the pump's flow and delay, and the paste's yield stress.

    Raises InputError if the bead does not determine them.
    """
    random = np.random.default_rng(SEED)
    noise = {name: random.standard_normal(DRAWS) for name in SOURCES}
    footprint = footprint_of(bead)

    def computed(*sources: str, count: int = DRAWS) -> tuple[Floats, Floats, Floats, Floats]:
        off = {name: noise[name][:count] * (name in sources) for name in SOURCES}
        density = laid.density_kg_m3 + laid.spread_of_density * off["density"]
        volume = 1e6 * (laid.mass_g + laid.mass_error_g * off["mass"]) / density
        scale, outward = 1 + bead.scale_error * off["scale"], bead.edge_error_mm * off["edge"]
        if (np.minimum(volume, np.minimum(density, bead.width_mm / 4 + outward)) <= 0).any():
            raise InputError(
                "the uncertainty of mass, density or edge is as large as the value. Measure this value more precisely."
            )
        per_mm = footprint.per_mm(volume, scale, outward, STRETCH)
        raw = footprint.volume_mm3(per_mm, scale, outward, STRETCH)[1]
        section = laid_section(per_mm, raw) * (1 + SECTION * off["section"])
        weight_pa_mm = density * GRAVITY_M_S2 * 1e-3
        whole = weight_pa_mm * slumped_stress(per_mm, raw) * (1 + LAW_ERROR * off["law"])
        edge = np.maximum(0.0, laid.edge_n_m + laid.edge_error_n_m * off["surface tension"])
        # For a disc, this is lambda R^2 / V (Roussel, Stefani and Leroy 2005). The area extends it to any outline.
        stress = whole - 1e3 * edge * bead.area_mm2 * scale**2 / (np.pi * volume)
        flow = section * laid.speed_mm_s * (1 + SPEED_ERROR * off["speed"])
        stiffness = whole / (weight_pa_mm * np.sqrt(section))
        return stress, flow, volume, stiffness

    drawn = computed(*SOURCES)
    stress, flow, volume, stiffness = (float(values[0]) for values in computed(count=1))
    section = flow / laid.speed_mm_s
    if (long := volume / section**1.5) < SHORTEST:
        raise InputError(
            f"the bead is {volume / section:.0f} mm long with a cross-section of {section:.3g} mm². The length is "
            f"{long:.1f} times the square root of the cross-section, but must be at least {SHORTEST:g} times, since "
            "paste flows from the middle towards the ends. Lay a longer bead, or less paste per mm."
        )
    if stiffness > STIFFEST:
        slower = laid.speed_mm_s * (STIFFEST / stiffness) ** 2
        raise InputError(
            f"with a yield stress of {stress:.2g} Pa, a bead of {section:.3g} mm² hardly changes its shape, so it does "
            f"not show the yield stress. Lay a bead at {slower:.2g} mm/s or slower with the same flow, at least "
            f"{SHORTEST * np.sqrt(flow / slower):.0f} mm long, or measure the spread of a cone of the paste."
        )
    if not stress > 0:
        raise InputError(
            f"the bead spread to a width of {bead.width_mm:.0f} mm, as water would do, so no yield stress can be "
            "determined. Check mass and density, or use a stiffer paste."
        )
    if not 1 / MISTYPED < flow / laid.asked_mm3_s < MISTYPED:
        raise InputError(
            f"the bead shows a flow of {flow:.3g} mm³/s, but --asked-mm3-s is {laid.asked_mm3_s:g}. No pump is wrong "
            f"by a factor of {MISTYPED:g}. Check the units: --asked-mm3-s in mm³/s, --mass-g in g, --density-kg-m3 in "
            "kg/m³, --speed-mm-s in mm/s."
        )
    parts = {name: float(computed(name)[0].std()) for name in SOURCES[:-2]}
    return BeadEstimate(
        _estimate(stress, np.maximum(drawn[0], 0.0)),
        _estimate(flow, drawn[1]),
        None if laid.start_mm is None else _delay(laid, np.array(laid.start_mm), bead, volume / section),
        volume / flow,
        section,
        stiffness,
        parts,
    )


def _estimate(value: float, drawn: Floats) -> PasteValue:
    low, high = np.quantile(drawn, (0.025, 0.975)).tolist()
    low, high = min(low, value), max(high, value)
    return PasteValue(value, (high - low) / 4, (low, high))


def _delay(laid: LaidBead, start_mm: Floats, bead: BeadOutline, laid_mm: float) -> PasteValue:
    """Return the time between the start of the nozzle and the beginning of the bead.

    Raises InputError if the start of the path is not on the line of the bead.
    """
    near, far = bead.tips_mm[np.argsort(np.linalg.norm(bead.tips_mm - start_mm, axis=1))]
    forth = (far - near) / bead.length_mm
    to_tip = near - start_mm
    aside = abs(float(forth[0] * to_tip[1] - forth[1] * to_tip[0]))
    begins_mm = float(to_tip @ forth) + (bead.length_mm - laid_mm) / 2
    error_mm = float(np.hypot(END * bead.width_mm, bead.edge_error_mm))
    if aside > MARK_WIDTHS * bead.width_mm or begins_mm < -3 * error_mm:
        raise InputError(
            f"--start-mm {start_mm[0]:g},{start_mm[1]:g} is not the start of the bead, which begins {begins_mm:.1f} mm "
            f"farther along its line and {aside:.1f} mm to the side. Give x and y in mm from the lower left corner of "
            "the frame's opening."
        )
    delay, error = max(0.0, begins_mm / laid.speed_mm_s), error_mm / laid.speed_mm_s
    return PasteValue(delay, error, (max(0.0, delay - 2 * error), delay + 2 * error))


def footprint_of(bead: BeadOutline) -> PasteArea:
    """Return the area of a bead, divided into classes by the distance to the edge."""
    ends = np.linspace(0, bead.inward_mm.max() * (1 + 1e-9), BINS + 1)
    piece_mm = MIDDLE * bead.length_mm
    middle = np.abs(bead.along_mm) < piece_mm / 2
    area, middle_area = (
        np.histogram(bead.inward_mm[pixels], ends)[0] * bead.cell_mm2 for pixels in (slice(None), middle)
    )
    return PasteArea((ends[1:] + ends[:-1]) / 2, area, bead.edge_mm, middle_area, piece_mm)


def material_of_bead(photo: PhotoInput, laid: LaidBead, warn: Callable[[str], None]) -> MeasuredPaste:
    """Measure a bead in a photo, and return the paste and the pump's flow.

    Raises InputError if the bead does not determine them.
    """
    if (start := laid.start_mm) is not None and photo.face_mm is not None:
        for name, coordinate, side in zip("xy", start, photo.face_mm, strict=True):
            if not 0 <= coordinate <= side:
                raise InputError(
                    f"--start-mm {start[0]:g},{start[1]:g}: {name} is outside the frame's opening of "
                    f"{photo.face_mm[0]:g} x {photo.face_mm[1]:g} mm. Give mm from the opening's lower left corner."
                )
    bead = measure_bead(photo, Path())
    for warning in bead.warnings:
        warn(warning.text)
    estimate = identify(laid, bead)
    material = measured_material(
        photo.file,
        laid,
        estimate.stress_pa,
        method="bead on a plate: closed form with stretching, from the whole outline, minus surface tension",
        basis=(
            f"bead of {laid.mass_g:g} g, {bead.length_mm:.2f} mm long, {bead.width_mm:.2f} mm wide and with a "
            f"cross-section of {estimate.section_mm2:.4g} mm² in the middle",
            f"yield stress divided by rho g sqrt(cross-section) {estimate.stiffness:.3f}, at most {STIFFEST:g}",
            by_source(estimate.parts_pa),
        ),
        not_for=BEAD_NOT_FOR,
    )
    row, flow, delay = estimate.pump_row(laid), estimate.flow_mm3_s, estimate.delay_s
    figures = {
        "bead_length_mm": bead.length_mm,
        "bead_width_mm": bead.width_mm,
        "section_mm2": estimate.section_mm2,
        "stiffness": estimate.stiffness,
        "parts_pa": estimate.parts_pa,
        "flow_mm3_s": flow.value,
        "flow_95_mm3_s": flow.interval,
        "delay_s": None if delay is None else delay.value,
        "delay_95_s": None if delay is None else delay.interval,
        "pump_row": row,
    }
    low, high = (end / laid.asked_mm3_s for end in flow.interval)
    sentences = [
        f"The pump gave {flow.value:.4g} mm³/s, {flow.value / laid.asked_mm3_s:.3f} times the requested "
        f"{laid.asked_mm3_s:g} mm³/s (95 % interval {low:.3f} to {high:.3f})."
    ]
    if delay is not None:
        sentences.append(
            f"The pump began {delay.value:.2f} s late "
            f"(95 % interval {delay.interval[0]:.2f} to {delay.interval[1]:.2f} s)."
        )
    sentences.append(f"Row for pump.csv ({','.join(row)}): {','.join(f'{value:g}' for value in row.values())}")
    return MeasuredPaste(material, figures, sentences)
