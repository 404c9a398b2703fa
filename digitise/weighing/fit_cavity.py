"""Fit width, depth and wall angle of a cavity to a liquid weighed into it. The photo and a gauge give the priors.

The volume below a level is that of straight walls between the traced outline and the floor. The unknowns are the mean
width w of the traced outline, the loss c of width for each millimetre down (c = 2 tan of a wall's angle, negative if
the walls open downward), the depth D of the floor, a factor on the liquid's density, and one on the height of its
meniscus. The posterior is that of least squares over the residuals of the steps and of the priors (Tarantola 2005,
section 3.2.3), linearised at its maximum. The angle's prior is flat, since a photo does not show it.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import chi2

from digitise.settings import AGAINST_EACH_OTHER, CrackShape
from digitise.solid.build_solid import shape_as_long_as
from digitise.solid.footprint import lay_out
from digitise.solid.slicer import Slicer
from digitise.solid.wedges import wall_shifts_mm
from digitise.weighing.fill import WeighedFill
from digitise.weighing.moved_walls import shape_by_weight, widened
from sealtwin.core.errors import InputError
from sealtwin.core.meniscus import capillary_length_mm, mean_level_mm
from sealtwin.core.records import Floats, Outline
from sealtwin.core.solid_figures import WeighedCavity


@dataclass(frozen=True)
class FitLimits:
    """Uncertainties that are used if none is declared, steps of the fit, and limits of reported differences.

    The comment on each line gives the reason for its value. Larger standard deviations widen the intervals;
    the limits only decide whether a difference is reported. benchmarks/weighing.py tests the intervals on emulated
    fills by which no value was chosen.
    """

    density_sd: float = 0.002  # Relative standard deviation of the density: 10 K of water
    meniscus_sd: float = 0.2  # Relative standard deviation of the meniscus's height: walls wetted within 35 degrees
    undeclared: float = 0.1  # Relative standard deviation of a width or a depth whose uncertainty is not declared
    passes: int = 3  # Fits, each with the solid's volumes at the walls of the one before
    slices: int = 48  # Horizontal slices of the solid
    least_share: float = 0.02  # Share of the cavity's volume below which the ratio of two volumes is not used
    least_probability: float = 0.01  # Probability of a misfit below which the steps contradict straight walls
    far: float = 2.5  # Standard deviations from which a difference is reported as a contradiction
    steepest: float = 2 * float(np.tan(np.radians(59.0)))  # Largest loss of width for each mm down, the tilt's own way
    opposed: float = 0.5  # The same against the tilt's way; findings allow ``steepest`` both ways
    thin_mm: float = 0.02  # Height of a slab of liquid whose volume gives the area of its surface
    normal_95: float = 1.96  # Half-width of a normal 95 % interval in standard deviations
    tiny: float = 1e-12  # Relative variance that is rounding
    unlike: float = 5.0  # Volume poured over that of upright walls, or the reverse, that no angle explains
    likelier: float = 6.0  # Difference of two misfits from which one tilt is better: twenty times as likely


LIMITS = FitLimits()
UNKNOWNS = 5
Booleans = NDArray[np.bool_]
WIDTH, CLOSING, DEPTH, DENSITY, MENISCUS = range(UNKNOWNS)


@dataclass(frozen=True)
class _Walls:
    """Straight walls along an outline; widths, depths and lengths of its stations, (n,)."""

    width_mm: Floats
    depth_mm: Floats
    along_mm: Floats  # Length of crack that each station represents
    at_floor: bool  # True if the traced width is that of the deepest floor, as of a flare
    inward: float  # 1 if the tilt closes downward, -1 if it opens downward
    scale_at_mm: Floats = field(default_factory=lambda: np.zeros(1))  # Depths, (m,), increasing
    scale: Floats = field(default_factory=lambda: np.ones(1))
    """Volume of the solid below each depth, divided by that of the sections. Side cracks, tips and bends cause the
    difference."""

    def volume_mm3(self, level_mm: Floats, unknown: Floats) -> Floats:
        """Return the volume below each level, (k,), with the walls moved by the unknowns."""
        mean_mm = self.width_mm @ self.along_mm / self.along_mm.sum()
        width_mm = np.maximum(self.width_mm * (1 + unknown[WIDTH] / mean_mm), 0.0)
        depth_mm = np.maximum(self.depth_mm + unknown[DEPTH], 0.0)
        closing = unknown[CLOSING]
        mouth_mm = width_mm + closing * depth_mm.max() if self.at_floor else width_mm
        whole_mm2 = _above_mm2(mouth_mm, depth_mm, closing)
        dry_mm2 = _above_mm2(mouth_mm, np.minimum(-level_mm[:, None], depth_mm), closing)
        return np.interp(-level_mm, self.scale_at_mm, self.scale) * ((whole_mm2 - dry_mm2) @ self.along_mm)

    def brim_mm3(self, unknown: Floats) -> float:
        return float(self.volume_mm3(np.zeros(1), unknown)[0])


def _above_mm2(mouth_mm: Floats, depth_mm: Floats, closing: float) -> Floats:
    """Return the area of a section from the face down to each depth, or to the depth at which its walls meet."""
    meet_mm = mouth_mm / closing if closing > 0 else np.inf
    open_mm = np.clip(np.minimum(depth_mm, meet_mm), 0.0, None)
    return mouth_mm * open_mm - closing * open_mm**2 / 2


@dataclass(frozen=True)
class _Fit:
    unknown: Floats
    covariance: Floats
    mean_level_mm: Floats  # Level of each step, the meniscus levelled
    misfit_mm3: Floats  # Weighed volume less that of the walls, at each step
    misfit_sd_mm3: Floats
    misfit: float  # Sum of the squared residuals over their standard deviations
    probability: float  # Of a misfit as large by chance


def weigh(
    outline: Outline, shape: CrackShape, fill: WeighedFill, width_sd_mm: float | None, depth_sd_mm: float | None
) -> tuple[Outline, CrackShape, WeighedCavity]:
    """Fit the cavity to the weighed fill and the priors; return its outline, its shape and the record of the fit.

    Args:
        outline: Crack as traced; its own interval of the width is used if ``width_sd_mm`` is None.
        shape: Depth by a gauge and the reading of the tilt; only walls that tilt against each other get an angle.
        fill: Fill whose file is loaded.
        width_sd_mm: Standard uncertainty of the traced mean width; None if undeclared.
        depth_sd_mm: Standard uncertainty of the depth; None if undeclared.
    """
    shape, _ = shape_as_long_as(outline.length_mm, shape)
    width_mm, depth_mm = outline.mean_width_mm, shape.deepest_mm
    prior_sd = np.array([
        width_sd_mm or outline.width_doubt_mm or LIMITS.undeclared * width_mm,
        np.inf,
        depth_sd_mm or LIMITS.undeclared * depth_mm,
        LIMITS.density_sd,
        LIMITS.meniscus_sd,
    ])  # fmt: skip
    tilted, findings = shape.tilt in AGAINST_EACH_OTHER, list[str]()
    walls = _walls(outline, shape)
    _require_likeness(walls, fill)
    if not tilted and len(fill.levels_mm) > 1:
        findings += _against_tilt(walls, fill, prior_sd, np.ones(UNKNOWNS, bool), shape)
    # Side cracks are part of the outline, and only a main crack can be widened.
    free = np.array([not outline.branches_kept, tilted, True, True, True])
    walls, fit = _fit_to_solid(outline, shape, fill, walls, prior_sd, free)
    if tilted and walls.inward * fit.unknown[CLOSING] < 0:
        findings += _against_tilt(walls, fill, prior_sd, free, shape)
        # The angle keeps its uncertainty; the other unknowns are those at upright walls.
        upright = _fit_to_solid(outline, shape, fill, walls, prior_sd, free & [True, False, True, True, True])
        walls, fit = upright[0], replace(upright[1], covariance=fit.covariance)
    findings += _contradictions(fit, prior_sd)
    if findings and tilted:
        findings += _other_tilt(outline, shape, fill, prior_sd, free, fit)
    return _result(outline, shape, walls, fill, fit, tuple(findings))


def _require_likeness(walls: _Walls, fill: WeighedFill) -> None:
    """Raise InputError if these walls do not give the fill's volume at any angle."""
    upright_mm3 = float(walls.volume_mm3(fill.levels_mm[-1:], np.zeros(UNKNOWNS))[0])
    poured_mm3 = float(fill.volume_mm3[-1])
    if not upright_mm3 / LIMITS.unlike < poured_mm3 < LIMITS.unlike * upright_mm3:
        raise InputError(
            f"crack.fill: the last level is reached with {poured_mm3 / 1e3:.3g} ml, but upright walls would take "
            f"{upright_mm3 / 1e3:.3g} ml. Check that masses are in grams and of the liquid only, and check the "
            "density, depth_mm and the photo's scale."
        )


def _walls(outline: Outline, shape: CrackShape) -> _Walls:
    s_mm = outline.s_mm
    gaps_mm = np.diff(s_mm)
    along_mm = np.concatenate([[gaps_mm[0]], gaps_mm[1:] + gaps_mm[:-1], [gaps_mm[-1]]]) / 2
    return _Walls(
        outline.width_mm,
        shape.depth_at_mm(s_mm),
        along_mm,
        shape.tilt == "flare",
        -1.0 if shape.tilt == "undercut" else 1.0,
    )


def _fit_to_solid(
    outline: Outline, shape: CrackShape, fill: WeighedFill, walls: _Walls, prior_sd: Floats, free: Booleans
) -> tuple[_Walls, _Fit]:
    """Fit with the volumes of the sections scaled to those of the solid at the fitted walls."""
    fit = _fit(walls, fill, prior_sd, np.zeros(UNKNOWNS), free)
    for _ in range(LIMITS.passes - 1):
        about = np.zeros(UNKNOWNS)
        about[CLOSING] = walls.inward * max(0.0, walls.inward * fit.unknown[CLOSING])
        walls = _in_proportion(walls, outline, shape, about)
        fit = _fit(walls, fill, prior_sd, about, free)
    return walls, fit


def _in_proportion(walls: _Walls, outline: Outline, shape: CrackShape, about: Floats) -> _Walls:
    moved = shape.model_copy(update={"wall_angle_deg": _angle_deg(abs(about[CLOSING]))})
    slicer = Slicer(lay_out(outline, moved, max(wall_shifts_mm(moved))), moved)
    at_mm = np.linspace(0.0, shape.deepest_mm, LIMITS.slices + 1)
    middle_mm2 = [slicer.cavity(depth_mm).area() for depth_mm in (at_mm[1:] + at_mm[:-1]) / 2]
    below_mm3 = np.cumsum(middle_mm2[::-1])[::-1] * at_mm[1]
    sections_mm3 = replace(walls, scale=np.ones(LIMITS.slices + 1), scale_at_mm=at_mm).volume_mm3(-at_mm[:-1], about)
    # A funnel may have closed above the deepest slices.
    sound = sections_mm3 > LIMITS.least_share * sections_mm3[0]
    return replace(walls, scale_at_mm=at_mm[:-1][sound], scale=below_mm3[sound] / sections_mm3[sound])


def _fit(
    walls: _Walls, fill: WeighedFill, prior_sd: Floats, about: Floats, free: Booleans, opposed: float = LIMITS.opposed
) -> _Fit:
    """Fit the ``free`` unknowns. The walls ``about`` give the area of the liquid's surface."""
    width_mm = float(walls.width_mm @ walls.along_mm / walls.along_mm.sum())
    capillary_mm = capillary_length_mm(fill.surface_tension_n_m, fill.density_kg_m3)
    lifted_mm = mean_level_mm(fill.levels_mm, width_mm, capillary_mm) - fill.levels_mm
    under_mm3 = [walls.volume_mm3(fill.levels_mm - below_mm, about) for below_mm in (0.0, LIMITS.thin_mm)]
    surface_mm2 = (under_mm3[0] - under_mm3[1]) / LIMITS.thin_mm
    level_sd_mm = np.where(fill.levels_mm < 0, fill.level_sd_mm, fill.flush_sd_mm)
    sd_mm3 = np.hypot(1e6 * fill.mass_sd_g / fill.density_kg_m3, surface_mm2 * level_sd_mm)
    # Scaled by the priors, so that steps and tolerances suit all unknowns.
    size = np.where(np.isfinite(prior_sd), prior_sd, 0.05)

    def unknown_of(scaled: Floats) -> Floats:
        unknown = np.zeros(UNKNOWNS)
        unknown[free] = scaled
        return unknown * size

    def level_mm(unknown: Floats) -> Floats:
        return np.minimum(fill.levels_mm + (1 + unknown[MENISCUS]) * lifted_mm, 0.0)

    def misfit_mm3(unknown: Floats) -> Floats:
        return fill.volume_mm3 * (1 + unknown[DENSITY]) - walls.volume_mm3(level_mm(unknown), unknown)

    def residuals(scaled: Floats) -> Floats:
        unknown = unknown_of(scaled)
        return np.concatenate([misfit_mm3(unknown) / sd_mm3, (unknown / prior_sd)[np.isfinite(prior_sd)]])

    low, high = np.full(UNKNOWNS, -np.inf), np.full(UNKNOWNS, np.inf)
    ends = np.sort(walls.inward * np.array([-opposed, LIMITS.steepest]))
    low[CLOSING], high[CLOSING] = ends / size[CLOSING]
    start = np.zeros(free.sum())
    solved = least_squares(residuals, start, bounds=(low[free], high[free]), x_scale="jac", xtol=1e-12, ftol=1e-12)
    covariance = np.zeros((UNKNOWNS, UNKNOWNS))
    covariance[np.ix_(free, free)] = np.linalg.pinv(solved.jac.T @ solved.jac)
    freedom = len(sd_mm3) - int(free[CLOSING])
    probability = float(chi2.sf(2 * solved.cost, freedom)) if freedom else 1.0
    if probability < LIMITS.least_probability:
        # If the steps scatter more than declared, the uncertainty grows with them.
        covariance *= 2 * solved.cost / freedom
    unknown = unknown_of(solved.x)
    covariance *= np.outer(size, size)
    return _Fit(unknown, covariance, level_mm(unknown), misfit_mm3(unknown), sd_mm3, 2 * solved.cost, probability)


def _against_tilt(walls: _Walls, fill: WeighedFill, prior_sd: Floats, free: Booleans, shape: CrackShape) -> list[str]:
    """Fit about upright walls that are free to open or close. Return a finding if they clearly do."""
    fit = _fit(walls, fill, prior_sd, np.zeros(UNKNOWNS), free, opposed=LIMITS.steepest)
    closing, sd = fit.unknown[CLOSING], np.sqrt(fit.covariance[CLOSING, CLOSING])
    if abs(closing) <= LIMITS.far * sd:
        return []
    closes, angle = closing > 0, f"{abs(_angle_deg(closing)):.1f} degrees each"
    if shape.tilt in AGAINST_EACH_OTHER:
        way, article = ("close", "an") if closes else ("open", "a")
        return [
            f"The weighed fill needs walls that {way} downward by {angle}, but those of {article} {shape.tilt} cannot: "
            "they are taken as upright. Check depth_mm, the photo's width and the levels."
        ]
    way, other = ("close", '"funnel" or "flare"') if closes else ("open", '"undercut"')
    return [
        f'The weighed fill shows walls that {way} downward by {angle}, but tilt = "{shape.tilt}" keeps their distance '
        f"constant: choose {other}."
    ]


def _other_tilt(
    outline: Outline, shape: CrackShape, fill: WeighedFill, prior_sd: Floats, free: Booleans, fit: _Fit
) -> list[str]:
    """Name each other tilt that fits clearly better than the chosen one, and about as well as the best."""
    misfits: dict[str, float] = {}
    for other in AGAINST_EACH_OTHER:
        turned = shape.model_copy(update={"tilt": other})
        walls, refit = _fit_to_solid(outline, turned, fill, _walls(outline, turned), prior_sd, free)
        if walls.inward * refit.unknown[CLOSING] >= 0:
            misfits[other] = refit.misfit
    likely = min([fit.misfit - LIMITS.likelier, *(misfit + LIMITS.likelier for misfit in misfits.values())])
    return [
        f'tilt = "{other}" fits the weighed fill better: the photo then shows the width of the '
        f"{'floor' if other == 'flare' else 'mouth'}."
        for other, misfit in misfits.items()
        if other != shape.tilt and misfit <= likely
    ]


def _contradictions(fit: _Fit, prior_sd: Floats) -> list[str]:
    findings: list[str] = []
    for index, name, what in ((WIDTH, "the photo's width", "width_mm"), (DEPTH, "depth_mm", "depth_mm")):
        if abs(off_mm := fit.unknown[index]) > LIMITS.far * prior_sd[index]:
            way = "more" if off_mm > 0 else "less"
            findings.append(
                f"The weighed fill contradicts {name}: it needs {abs(off_mm):.2f} mm {way}, but the standard "
                f"uncertainty ({what}) is {prior_sd[index]:.2f} mm."
            )
    if fit.probability < LIMITS.least_probability:
        worst = int(np.argmax(np.abs(fit.misfit_mm3 / fit.misfit_sd_mm3)))
        findings.append(
            f"The steps of the weighed fill do not fit straight walls: step {worst + 1} is off by "
            f"{fit.misfit_mm3[worst] / 1e3:+.3f} ml, but its standard uncertainty is "
            f"{fit.misfit_sd_mm3[worst] / 1e3:.3f} ml."
        )
    return findings


def _result(
    outline: Outline, shape: CrackShape, walls: _Walls, fill: WeighedFill, fit: _Fit, findings: tuple[str, ...]
) -> tuple[Outline, CrackShape, WeighedCavity]:
    off, covariance = fit.unknown, fit.covariance[:DENSITY, :DENSITY]
    gradient = np.array([
        (walls.brim_mm3(off + step) - walls.brim_mm3(off - step)) / 2e-4 for step in 1e-4 * np.eye(UNKNOWNS)[:DENSITY]
    ])  # fmt: skip
    brim_mm3 = walls.brim_mm3(off)
    half_mm3 = LIMITS.normal_95 * float(np.sqrt(gradient @ covariance @ gradient))
    # From the loss of width to degrees, and in the order of the record's fields.
    to_degrees = np.diag([1.0, walls.inward * np.degrees(0.5 / (1 + off[CLOSING] ** 2 / 4)), 1.0])
    in_degrees = to_degrees @ covariance @ to_degrees
    width_mm, depth_mm = outline.mean_width_mm + off[WIDTH], shape.deepest_mm + off[DEPTH]
    record = WeighedCavity(
        levels_mm=tuple(fit.mean_level_mm.tolist()),
        volumes_mm3=tuple(fill.volume_mm3.tolist()),
        misfits_mm3=tuple(fit.misfit_mm3.tolist()),
        misfit_sds_mm3=tuple(fit.misfit_sd_mm3.tolist()),
        slabs_mm=_slabs_mm(fill, walls, fit),
        width_mm=float(width_mm),
        wall_angle_deg=_angle_deg(abs(off[CLOSING])),
        depth_mm=float(depth_mm),
        steps=tuple(tuple(row) for row in _root(in_degrees).tolist()),
        volume_95_mm3=(max(0.0, brim_mm3 - half_mm3), brim_mm3 + half_mm3),
        findings=findings,
    )
    return widened(outline, float(off[WIDTH])), shape_by_weight(shape, record), record


def _slabs_mm(fill: WeighedFill, walls: _Walls, fit: _Fit) -> tuple[tuple[float, float, float], ...]:
    """Return the slab that each step after the first added, if it is high enough to show its width.

    A slab is the depth of its middle, its mean width, and the standard deviation of that width.
    """
    length_mm = walls.scale[0] * walls.along_mm.sum()
    height_mm, volume_mm3 = np.diff(fit.mean_level_mm), np.diff(fill.volume_mm3)
    middle_mm = -(fit.mean_level_mm[1:] + fit.mean_level_mm[:-1]) / 2
    # Two readings that nearly agree do not show the width between them.
    apart = height_mm > fill.level_sd_mm
    width_mm = volume_mm3[apart] / (height_mm[apart] * length_mm)
    of_scale_mm = np.sqrt(2) * 1e6 * fill.mass_sd_g / fill.density_kg_m3 / (height_mm[apart] * length_mm)
    sd_mm = np.hypot(of_scale_mm, width_mm * np.sqrt(2) * fill.level_sd_mm / height_mm[apart])
    return tuple(zip(middle_mm[apart].tolist(), width_mm.tolist(), sd_mm.tolist(), strict=True))


def _root(covariance: Floats) -> Floats:
    """Return the lower triangular root, (k, k), with a column of zeros for an unknown without variance.

    Column i is the change of unknown i and of later ones for one standard deviation of it, given the earlier ones.
    """
    root, rest = np.zeros_like(covariance), covariance.copy()
    for i in range(len(covariance)):
        if rest[i, i] > LIMITS.tiny * max(covariance[i, i], LIMITS.tiny):
            root[:, i] = rest[:, i] / np.sqrt(rest[i, i])
            rest -= np.outer(root[:, i], root[:, i])
    return root


def _angle_deg(closing: float) -> float:
    return float(np.degrees(np.arctan(closing / 2)))
