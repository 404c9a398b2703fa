"""Fit width, depth and wall angle of a cavity to a liquid weighed into it. The photo and a gauge give the priors.

The model has straight walls between the traced outline and the floor. The first unknown is the change of the mean
width. The second is the loss of width for each millimetre down, 2 tan of a wall's angle, which is negative if the walls
open downward. The third is the change of the floor's depth. Errors of the liquid's density and of the height of its
meniscus affect all steps, so the steps are correlated. The posterior comes from least squares over the residuals of the
steps and of the priors (Tarantola 2005, section 3.2.3), linearised at its maximum. The angle's prior is flat, since a
photo does not show the angle.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import approx_fprime, least_squares
from scipy.stats import chi2

from digitise.settings import CrackShape
from digitise.solid.build_solid import shape_as_long_as
from digitise.solid.footprint import lay_out
from digitise.solid.sections import Slicer
from digitise.solid.wedges import wall_shifts_mm
from digitise.weighing.fill import WeighedFill
from digitise.weighing.moved_walls import shape_by_weight, widened
from sealtwin.core.arrays import midpoints
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact, Facts, doubt
from sealtwin.core.records import Booleans, Floats, Outline
from sealtwin.core.regime import capillary_length_mm, mean_level_mm
from sealtwin.core.solid_figures import WeighedCavity

# Uncertainties that nobody declares, steps of the fit, and limits of reported differences. Larger standard
# deviations widen the intervals, and the limits only decide whether a difference is reported. benchmarks/weighing.py
# tests the intervals on emulated fills that were not used to choose a value.
DENSITY_SD = 0.002  # Relative standard deviation of the density: that of water over 10 K
MENISCUS_SD = 0.2  # Relative standard deviation of the meniscus's height: walls wetted within 35 degrees
UNDECLARED = 0.1  # Relative standard deviation of a width or depth whose uncertainty is not declared
PASSES = 3  # Number of fits. Each uses the solid's volumes at the walls of the fit before
SLICES = 48  # Number of horizontal slices of the solid
MIN_SHARE = 0.02  # The ratio of two volumes is not used below this share of the cavity's volume
MIN_PROBABILITY = 0.01  # The steps contradict straight walls if a misfit as large has a lower probability
CONTRADICTION_SIGMAS = 2.5  # A difference of this many standard deviations or more is reported as a contradiction
STEEPEST = 2 * np.tan(np.radians(59.0))  # Largest loss or gain of width for each mm down
THIN_MM = 0.02  # Height of a slab of liquid whose volume gives the area of the liquid's surface
NORMAL_95 = 1.96  # Half-width of a normal 95 % interval, in standard deviations
# No angle explains a ratio this large between the poured volume and that of upright walls, or its inverse
VOLUME_RATIO = 5.0
WIDTH, CLOSING, DEPTH = range(3)


@dataclass(frozen=True)
class _Walls:
    """Straight walls along an outline. Widths, depths and lengths are given at its stations, (n,)."""

    width_mm: Floats
    depth_mm: Floats
    along_mm: Floats  # Length of crack that each station represents
    at_floor: bool  # True if the traced width is that of the deepest floor, as in a flare
    scale_at_mm: Floats  # Depths at which ``scale`` is given, (m,), increasing
    scale: Floats
    """Volume of the solid below each depth, divided by the volume of the sections, (m,). Side cracks, tips and bends
    cause the difference."""

    def volume_mm3(self, level_mm: Floats, unknown: Floats) -> Floats:
        """Return the volume below each level, (k,), with the walls moved by the unknowns."""
        wider_mm, closing, deeper_mm = unknown
        mean_mm = np.average(self.width_mm, weights=self.along_mm)
        mouth_mm = np.maximum(self.width_mm * (1 + wider_mm / mean_mm), 0.0)
        depth_mm = np.maximum(self.depth_mm + deeper_mm, 0.0)
        if self.at_floor:
            mouth_mm = mouth_mm + closing * depth_mm.max()
        floor_mm = np.minimum(depth_mm, mouth_mm / closing) if closing > 0 else depth_mm
        floor_mm = np.maximum(floor_mm, 0.0)
        dry_mm = np.clip(-level_mm[:, None], 0.0, floor_mm)
        section_mm2 = (mouth_mm - closing * (floor_mm + dry_mm) / 2) * (floor_mm - dry_mm)
        return np.interp(-level_mm, self.scale_at_mm, self.scale) * (section_mm2 @ self.along_mm)


@dataclass(frozen=True)
class _Fit:
    unknown: Floats
    root: Floats
    """Lower triangular root of the covariance, (3, 3). Column i is the change of unknown i and of the later unknowns
    for one standard deviation of unknown i, with the earlier unknowns fixed. A fixed unknown has zeros."""
    mean_level_mm: Floats  # Mean level across the crack at each step, corrected for the meniscus
    misfit_mm3: Floats  # Weighed volume, less the volume between the walls, at each step
    misfit_sd_mm3: Floats
    probability: float  # Probability of a misfit at least as large by chance


def weigh(
    outline: Outline, shape: CrackShape, fill: WeighedFill, width_sd_mm: float | None, depth_sd_mm: float | None
) -> tuple[Outline, CrackShape, WeighedCavity]:
    """Fit the cavity to the weighed fill and the priors. Return its outline, its shape and the record of the fit.

    Raises InputError if no angle of the walls explains the fill's volume.

    Args:
        outline: Traced crack. The width's interval in it is used if ``width_sd_mm`` is None.
        shape: Depth from a gauge, and the tilt. Only walls that lean in opposite directions get an angle.
        fill: Fill whose file is loaded.
        width_sd_mm: Standard uncertainty of the traced mean width. None if undeclared.
        depth_sd_mm: Standard uncertainty of the depth. None if undeclared.
    """
    shape, _ = shape_as_long_as(outline.length_mm, shape)
    width_sd_mm = width_sd_mm or outline.width_doubt_mm or UNDECLARED * outline.mean_width_mm
    prior_sd = np.array([width_sd_mm, np.inf, depth_sd_mm or UNDECLARED * shape.deepest_mm])
    inward, findings = -shape.tilting.opens, list[Fact]()
    upright_mm3 = _walls(outline, shape).volume_mm3(fill.levels_mm[-1:], np.zeros(3))[0]
    poured_mm3 = fill.volume_mm3[-1]
    if not upright_mm3 / VOLUME_RATIO < poured_mm3 < VOLUME_RATIO * upright_mm3:
        raise InputError(
            f"crack.fill: the last level is reached with {poured_mm3 / 1e3:.3g} ml, but upright walls would need "
            f"{upright_mm3 / 1e3:.3g} ml. Check that masses are in grams and of the liquid only, and check the "
            "density, depth_mm and the photo's scale."
        )
    # Side cracks are part of the outline, and only a main crack can be widened. One step shows no angle of parallel
    # walls.
    free = np.array([not outline.branches_kept, bool(inward) or len(fill.levels_mm) > 1, True])
    walls, fit = _fit_to_solid(outline, shape, fill, prior_sd, free)
    if inward * fit.unknown[CLOSING] <= 0:
        findings += _against_tilt(fit, shape)
        walls, upright = _fit_to_solid(outline, shape, fill, prior_sd, free & [True, False, True])
        # The angle keeps its uncertainty; the other unknowns are those at upright walls.
        fit = replace(upright, root=fit.root) if inward else upright
    findings += _contradictions(fit, prior_sd)
    return _result(outline, shape, walls, fill, fit, tuple(findings))


def _walls(outline: Outline, shape: CrackShape) -> _Walls:
    s_mm = outline.s_mm
    return _Walls(
        outline.width_mm,
        shape.depth_at_mm(s_mm),
        np.gradient(s_mm) * np.r_[0.5, np.ones(len(s_mm) - 2), 0.5],
        shape.tilting.floor_traced,
        np.zeros(1),
        np.ones(1),
    )


def _fit_to_solid(
    outline: Outline, shape: CrackShape, fill: WeighedFill, prior_sd: Floats, free: Booleans
) -> tuple[_Walls, _Fit]:
    """Fit the unknowns after the volumes of the sections are scaled to those of the solid at the fitted walls."""
    walls, about, inward = _walls(outline, shape), np.zeros(3), -shape.tilting.opens
    fit = _fit(walls, fill, prior_sd, about, free)
    for _ in range(PASSES - 1):
        about[CLOSING] = inward * max(0.0, inward * fit.unknown[CLOSING])
        walls = _in_proportion(walls, outline, shape, about)
        fit = _fit(walls, fill, prior_sd, about, free)
    return walls, fit


def _in_proportion(walls: _Walls, outline: Outline, shape: CrackShape, about: Floats) -> _Walls:
    moved = shape.model_copy(update={"wall_angle_deg": _angle_deg(abs(about[CLOSING]))})
    slicer = Slicer(lay_out(outline, moved, max(wall_shifts_mm(moved))), moved)
    at_mm = np.linspace(0.0, shape.deepest_mm, SLICES + 1)
    middle_mm2 = [slicer.cavity(depth_mm).area() for depth_mm in midpoints(at_mm)]
    below_mm3 = np.cumsum(middle_mm2[::-1])[::-1] * at_mm[1]
    sections_mm3 = replace(walls, scale=np.ones(len(at_mm)), scale_at_mm=at_mm).volume_mm3(-at_mm[:-1], about)
    # A funnel may have closed above the deepest slices.
    sound = sections_mm3 > MIN_SHARE * sections_mm3[0]
    return replace(walls, scale_at_mm=at_mm[:-1][sound], scale=below_mm3[sound] / sections_mm3[sound])


def _fit(walls: _Walls, fill: WeighedFill, prior_sd: Floats, about: Floats, free: Booleans) -> _Fit:
    """Fit the ``free`` unknowns. The walls moved by ``about`` give the area of the liquid's surface."""
    capillary_mm = capillary_length_mm(fill.surface_tension_n_m, fill.density_kg_m3)
    width_mm = float(np.average(walls.width_mm, weights=walls.along_mm))
    level_mm = np.minimum(mean_level_mm(fill.levels_mm, width_mm, capillary_mm), 0.0)
    under_mm3, below_mm3 = (walls.volume_mm3(fill.levels_mm - down_mm, about) for down_mm in (0.0, THIN_MM))
    surface_mm2 = (under_mm3 - below_mm3) / THIN_MM
    level_sd_mm = np.where(fill.levels_mm < 0, fill.level_sd_mm, fill.flush_sd_mm)
    alone_mm3 = np.hypot(1e6 * fill.mass_sd_g / fill.density_kg_m3, surface_mm2 * level_sd_mm)
    lifted_mm3 = (level_mm - fill.levels_mm) * surface_mm2
    common_mm3 = np.column_stack([DENSITY_SD * fill.volume_mm3, MENISCUS_SD * lifted_mm3])
    of_steps = np.diag(alone_mm3**2) + common_mm3 @ common_mm3.T
    whiten = np.linalg.inv(np.linalg.cholesky(of_steps))

    def moved(values: Floats) -> tuple[Floats, Floats]:
        unknown = np.zeros(3)
        unknown[free] = values
        return unknown, fill.volume_mm3 - walls.volume_mm3(level_mm, unknown)

    def residuals(values: Floats) -> Floats:
        unknown, misfit_mm3 = moved(values)
        return np.concatenate([whiten @ misfit_mm3, unknown / prior_sd])

    most = np.array([np.inf, STEEPEST, np.inf])[free]
    solved = least_squares(residuals, np.zeros(len(most)), bounds=(-most, most), x_scale="jac", xtol=1e-12, ftol=1e-12)
    root = np.zeros((3, 3))
    # J = Q R in reversed order: the covariance is R^-1 R^-T, which is a lower root in the order of the unknowns.
    root[np.ix_(free, free)] = np.linalg.inv(np.linalg.qr(solved.jac[:, ::-1], mode="r"))[::-1, ::-1]
    freedom = len(alone_mm3) - int(free[CLOSING])
    probability = float(chi2.sf(2 * solved.cost, freedom)) if freedom else 1.0
    if probability < MIN_PROBABILITY:
        # If the steps scatter more than declared, the uncertainty grows with them.
        root *= np.sqrt(2 * solved.cost / freedom)
    unknown, misfit_mm3 = moved(solved.x)
    return _Fit(unknown, root, level_mm, misfit_mm3, np.sqrt(of_steps.diagonal()), probability)


def _against_tilt(fit: _Fit, shape: CrackShape) -> list[Fact]:
    """Return a finding if the fit clearly needs walls that the tilt does not allow."""
    closing = fit.unknown[CLOSING]
    if abs(closing) <= CONTRADICTION_SIGMAS * np.linalg.norm(fit.root[CLOSING]):
        return []
    way, others = ("close", '"funnel" or "flare"') if closing > 0 else ("open", '"undercut"')
    taken = "they are taken as upright" if shape.tilting.opens else "it keeps their distance constant"
    text = (
        f"The weighed fill needs walls that {way} downward by {abs(_angle_deg(closing)):.1f} degrees each, but tilt = "
        f'"{shape.tilt}" does not allow this: {taken}. Choose {others}, or check depth_mm, the photo\'s width and '
        "the levels."
    )
    return [doubt("weighing.against-tilt", text, _angle_deg(closing), "deg")]


def _contradictions(fit: _Fit, prior_sd: Floats) -> list[Fact]:
    findings: list[Fact] = []
    for index, name, setting in ((WIDTH, "the photo's width", "width_mm"), (DEPTH, "depth_mm", "depth_mm")):
        if abs(off_mm := fit.unknown[index]) > CONTRADICTION_SIGMAS * prior_sd[index]:
            way = "more" if off_mm > 0 else "less"
            text = (
                f"The weighed fill contradicts {name}: it needs {abs(off_mm):.2f} mm {way}, but the standard "
                f"uncertainty of {setting} is only {prior_sd[index]:.2f} mm."
            )
            findings.append(doubt(f"weighing.contradicts.{setting}", text, float(off_mm), "mm"))
    if fit.probability < MIN_PROBABILITY:
        worst = int(np.argmax(np.abs(fit.misfit_mm3 / fit.misfit_sd_mm3)))
        text = (
            f"The steps of the weighed fill do not fit straight walls: step {worst + 1} is off by "
            f"{fit.misfit_mm3[worst] / 1e3:+.3f} ml, but its standard uncertainty is only "
            f"{fit.misfit_sd_mm3[worst] / 1e3:.3f} ml."
        )
        findings.append(doubt("weighing.misfit", text, fit.misfit_mm3[worst] / 1e3, "ml"))
    return findings


def _result(
    outline: Outline, shape: CrackShape, walls: _Walls, fill: WeighedFill, fit: _Fit, findings: Facts
) -> tuple[Outline, CrackShape, WeighedCavity]:
    off = fit.unknown

    def brim_mm3(unknown: Floats) -> float:
        return float(walls.volume_mm3(np.zeros(1), unknown)[0])

    middle_mm3, gradient = brim_mm3(off), np.asarray(approx_fprime(off, brim_mm3, 1e-6), float)
    half_mm3 = NORMAL_95 * float(np.linalg.norm(gradient @ fit.root))
    degrees = -shape.tilting.opens * np.degrees(0.5 / (1 + off[CLOSING] ** 2 / 4))
    steps = np.array([1.0, degrees, 1.0])[:, None] * fit.root
    steps *= np.where(steps.diagonal() < 0, -1.0, 1.0)
    record = WeighedCavity(
        levels_mm=tuple(fit.mean_level_mm.tolist()),
        volumes_mm3=tuple(fill.volume_mm3.tolist()),
        misfits_mm3=tuple(fit.misfit_mm3.tolist()),
        misfit_sds_mm3=tuple(fit.misfit_sd_mm3.tolist()),
        width_mm=float(outline.mean_width_mm + off[WIDTH]),
        wall_angle_deg=_angle_deg(abs(off[CLOSING])),
        depth_mm=float(shape.deepest_mm + off[DEPTH]),
        steps=tuple(map(tuple, steps.tolist())),
        volume_95_mm3=(max(0.0, middle_mm3 - half_mm3), middle_mm3 + half_mm3),
        findings=findings,
    )
    return widened(outline, float(off[WIDTH])), shape_by_weight(shape, record), record


def _angle_deg(closing: float) -> float:
    return float(np.degrees(np.arctan(closing / 2)))
