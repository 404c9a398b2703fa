"""Errors of a level that extra runs determine: inputs, particle size, scatter of runs, and changes of volume."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import combinations
from typing import Any, Self

import numpy as np
from pydantic import TypeAdapter

from sealtwin.core.arrays import Floats, Integers, Numbers, rms
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Facts
from sealtwin.core.run_figures import FAST, Method
from validate.intervals import InputEffect, SizeSeries
from validate.uncertainty.budget import Component, chi_squared, draws_for, half_width, normals, uniforms
from validate.units import LABELS, MODELS

RUNS = 1_000  # Number of runs of the fast model. They determine a standard deviation to 2 %.
Z_95 = 1.96
"""Half-width of a 95 % band, in standard deviations. The variance of the band is averaged over the positions along the
crack. About 50 of these are independent in a run, so two runs determine the variance."""


def drawn_inputs(names: Iterable[str], runs: int = RUNS) -> Floats:
    """Return random errors of each input, in units of its standard uncertainty, (runs, n).

    The same name always gives the same numbers.
    """
    return np.hstack([normals(name, 1, runs) for name in names])


def along(s_mm: Floats, known_mm: Floats, levels_mm: Floats) -> Floats:
    """Return levels that are known at ``known_mm``, interpolated at ``s_mm``, (runs, k)."""
    return np.reshape([np.interp(s_mm, known_mm, level_mm) for level_mm in levels_mm], (-1, len(s_mm)))


@dataclass(frozen=True)
class Effect:
    """Effect of one input's standard uncertainty on the simulated level."""

    name: str  # Name of the setting in [uncertainty]
    standard: float  # Declared standard uncertainty, in the unit at the end of the name
    level_mm: Numbers  # Change of the level if the input is increased by ``standard``, at each s


@dataclass(frozen=True)
class Inputs:
    """Effects of the n varied inputs on the levels at k positions, computed with one model."""

    model: Method
    standards: Mapping[str, float]  # Declared standard uncertainty of each input, by its name in [uncertainty]
    straight_mm: Floats  # (n, k): change of the level if an input is increased by its uncertainty
    curved_mm: Floats  # (n, k): further change, equal for an increased and a reduced input; 0 for particles
    together_mm: Floats  # (draws, k): change due to interactions of the inputs; (0, k) for particles

    def interpolated(self, known_mm: Floats, s_mm: Floats) -> "Inputs":
        """Return the effects at ``s_mm``, interpolated from ``known_mm``."""
        changes_mm = self.straight_mm, self.curved_mm, self.together_mm
        return Inputs(self.model, self.standards, *(along(s_mm, known_mm, change_mm) for change_mm in changes_mm))

    def errors(self) -> list[Component]:
        """Return the errors of the level that the effects cause, at the stations for which the effects are known."""
        stations, components = self.straight_mm.shape[1], list[Component]()
        for name, straight_mm, curved_mm in zip(self.standards, self.straight_mm, self.curved_mm, strict=True):
            z = normals(name, 1, draws_for(stations))
            draws_mm = z * straight_mm + z**2 * curved_mm
            components.append(self._component(LABELS["inputs"][name][0], draws_mm, f"uncertainty.{name}"))
        if runs := len(self.together_mm):
            # The runs are shuffled, so that they are independent of the draws of single inputs.
            order = np.random.default_rng(stations).permutation(np.arange(draws_for(stations)) % runs)
            components.append(self._component("inputs in combination", self.together_mm[order], ""))
        return components

    def _component(self, name: str, draws_mm: Floats, setting: str) -> Component:
        name = f"{name}, {MODELS[self.model]}"
        return Component(name, "declared", draws_mm, shared=True, kind="inputs", setting=setting)

    def reported(self, x: Floats) -> tuple[tuple[InputEffect, ...], float]:
        """Return each effect on the mean level over x, and the fraction of the variance that is due to interactions.

        For a standard normal z, the variance of a z + b z^2 is a^2 + 2 b^2, with a the straight and b the curved part
        of an effect.
        """
        straight, curved, together = (
            np.trapezoid(levels_mm, x) / (x[-1] - x[0])
            for levels_mm in (self.straight_mm, self.curved_mm, self.together_mm)
        )
        alone = straight**2 + 2 * curved**2
        both = float(np.var(together)) if len(together) else 0.0
        whole = alone.sum() + both
        effects = tuple(
            InputEffect(
                name=name,
                standard=standard,
                mean_level_mm=float(mean_mm),
                largest_mm=float(np.abs(level_mm).max()),
                share=float(part / whole) if whole else 0.0,
                model=self.model,
            )
            for (name, standard), mean_mm, level_mm, part in zip(
                self.standards.items(), straight, self.straight_mm, alone, strict=True
            )
        )
        return effects, both / whole if whole else 0.0


@dataclass(frozen=True)
class InputDraws:
    """Runs of the fast model in which all inputs vary at random together, relative to the run with unchanged inputs."""

    s_mm: Numbers  # (k,)
    standards: dict[str, float]  # Declared standard uncertainty of each input, by its name in [uncertainty]
    moved_mm: Numbers  # (runs, k): level minus the level with unchanged inputs

    @cached_property
    def inputs(self) -> Inputs:
        """Effect of each single input: a parabola that is 0 at the unchanged input, fitted by least squares.

        The draws of two inputs are independent. The variance of an input's parabola, divided by the variance of all
        runs, is therefore its first-order index (Saltelli et al. 2008, Global Sensitivity Analysis, 1.2).
        """
        z = drawn_inputs(self.standards, len(self.moved_mm))
        terms = np.hstack([z, z**2])
        coefficients = np.linalg.lstsq(terms, self.moved_mm)[0]
        straight_mm, curved_mm = np.array(np.split(coefficients, 2), np.float64)
        return Inputs(FAST, self.standards, straight_mm, curved_mm, self.moved_mm - terms @ coefficients)


ORDERS = np.linspace(0.5, 2.0, 61)
"""Allowed orders of convergence. Below the lowest order, an error would look constant over so few sizes. The highest
order is that of the scheme's best part (Oberkampf & Roy 2010, 8.6.4)."""
MIN_RUNS = 2  # Smallest number of runs at a size, since a single run shows no scatter
ROUNDING_MM2 = 1e-12  # Square of a residual due to rounding


@dataclass(frozen=True)
class Replicates:
    """Results of runs with different seeds at each of three particle sizes.

    The discretisation error at the middle size is a in f0 + a h^p, fitted by least squares, where h is the radius
    divided by the middle radius. The order p is averaged over its likelihood, with flat priors of f0 and a. The
    likelihood is computed from the mean of the results, so all results have the same p. All sizes have the same
    scatter.
    """

    radii_mm: Sequence[float]  # From the finest to the coarsest
    runs: Sequence[Floats]  # (runs, k) for each size
    mean_of: int = 1  # Number of runs at the middle size whose mean is the level

    @cached_property
    def means(self) -> Floats:
        """Mean over the runs at each size, (3, k)."""
        return np.array([runs.mean(axis=0) for runs in self.runs])

    @cached_property
    def scatter(self) -> Floats:
        """Standard deviation of a single run, pooled over the sizes, (k,)."""
        return np.sqrt((self._residuals**2).sum(axis=0) / (self._count - len(self.runs)))

    def size_errors(self, draws: int) -> Floats:
        """Return draws of the discretisation error at the middle size, (draws, k).

        For a given p, the draws follow Student's t distribution, with the covariance that the k results have in the
        residuals.
        """
        error, squares, lack = self._fits(self.orders(draws))
        noise = normals("particle size", self._count + 1, draws)
        off = noise[:, :-1] @ self._residuals + noise[:, -1:] * lack
        freedom = self._count - 2
        return error + off / np.sqrt(
            squares[:, None] * chi_squared(uniforms("particle size, chi squared", 1, draws), freedom)
        )

    def single_runs(self, draws: int) -> Floats:
        """Return draws of the deviation of the level from the mean over all seeds, (draws, k)."""
        freedom = self._count - len(self.runs)
        off = normals("single run", self._count, draws) @ self._residuals
        return off / np.sqrt(self.mean_of * chi_squared(uniforms("single run, chi squared", 1, draws), freedom))

    def orders(self, draws: int) -> Floats:
        """Return draws of the order p, (draws,)."""
        _, squares, lack = self._fits(ORDERS)
        residual = (self._residuals.mean(axis=1) ** 2).sum() + lack.mean(axis=1) ** 2 + ROUNDING_MM2
        likelihood = -np.log(squares) / 2 - (self._count - 2) / 2 * np.log(residual)
        density = np.exp(likelihood - likelihood.max())
        share = np.append(0.0, np.cumsum(density[1:] + density[:-1]))
        return np.interp(uniforms("order of convergence", 1, draws)[:, 0], share / share[-1], ORDERS)

    @cached_property
    def _residuals(self) -> Floats:
        """Difference of each run from the mean at its size, (runs of all sizes, k)."""
        return np.vstack([runs - mean for runs, mean in zip(self.runs, self.means, strict=True)])

    @property
    def _count(self) -> int:
        return sum(map(len, self.runs))

    def _fits(self, orders: Floats) -> tuple[Floats, Floats, Floats]:
        """Fit level = f0 + a h^p for each of m orders p, with h the radius divided by the middle radius.

        Returns a, (m, k), the weighted sum of squares of h^p about its mean, (m,), and the residual, (m, k).
        """
        weight = np.array([len(runs) for runs in self.runs], float)
        root = np.sqrt(weight)
        power = (np.asarray(self.radii_mm) / self.radii_mm[1]) ** orders[:, None]
        slope = power - (power @ weight / weight.sum())[:, None]
        squares = slope**2 @ weight
        error = (slope * weight) @ self.means / squares[:, None]
        # The direction in the space of the three means that f0 and a cannot fit.
        across = np.cross(root, root * power)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        return error, squares, across @ (root[:, None] * self.means)


def size_series(values: Sequence[Sequence[float]], radii_mm: Sequence[float]) -> SizeSeries:
    """Return the record of one result at three particle sizes. ``values`` are the runs' results, by size."""
    replicates = Replicates(radii_mm, [np.array(runs)[:, None] for runs in values])
    draws = draws_for(1)
    low, high = np.quantile(replicates.orders(draws), (0.025, 0.975))
    return SizeSeries(
        values=tuple(float(mean) for mean in replicates.means[:, 0]),
        runs=tuple(map(len, values)),
        scatter=float(replicates.scatter[0]),
        order_95=(float(low), float(high)),
        band=float(half_width(replicates.size_errors(draws)[:, 0])),
    )


def numerical_errors(replicates: Replicates, volume_level_mm: float | None) -> list[Component]:
    """Return the numerical errors of the level at each of k stations.

    They include a shift of all levels together, up or down by at most ``volume_level_mm``, for volume gained or lost.
    The fit over particle sizes already contains an unknown part of this shift.
    """
    stations = replicates.means.shape[1]
    draws, runs = draws_for(stations), replicates.mean_of
    parts = [
        ("particle size", replicates.size_errors(draws)),
        (f"scatter of {'single runs' if runs == 1 else f'the mean of {runs} runs'}", replicates.single_runs(draws)),
    ]
    if volume_level_mm is not None:
        moved_mm = volume_level_mm * (2 * uniforms("volume of the numerics", 1, draws) - 1)
        parts.append(("volume gained or lost by the numerics", np.tile(moved_mm, stations)))
    return [Component(name, "computed", draws_mm, shared=True, kind="numerics") for name, draws_mm in parts]


def two_level_design(inputs: int) -> Integers:
    """Return -1 or 1 for each run and input, (runs, inputs): columns of a Hadamard matrix, balanced and orthogonal.

    Up to 1, 3, 7 or 15 inputs take 2, 4, 8 or 16 runs (Plackett & Burman 1946). Each effect is a difference between two
    halves of all runs, which averages out most of the scatter of single runs. The interaction of two inputs cannot be
    separated from the effect of a third one.
    """
    return _matrix(inputs)[:, 1 : inputs + 1]


def effects_of(results: Floats, inputs: int) -> tuple[Floats, float | None]:
    """Return the effect of each input, from its middle to its upper value, (inputs, k), and its scatter by chance.

    ``results``, (runs, k), are in the order of ``two_level_design``. The scatter is the standard deviation, as root
    mean square over k, in the columns without an input. It is None if every column has an input.
    """
    contrasts = _matrix(inputs).T @ results / len(results)
    spare = contrasts[inputs + 1 :]
    return contrasts[1 : inputs + 1], rms(spare) if len(spare) else None


def _matrix(inputs: int) -> Integers:
    from scipy.linalg import hadamard

    return np.asarray(hadamard(2 ** max(1, inputs.bit_length())), np.int64)


@dataclass(frozen=True)
class SizeRuns:
    """Levels of runs with different seeds, particles of one size and the same physics."""

    radius_mm: float
    levels_mm: Numbers  # (runs, k)


@dataclass(frozen=True)
class Spread:
    """Levels of all extra runs at the positions ``s_mm``, (k,)."""

    s_mm: Numbers
    sizes: tuple[SizeRuns, SizeRuns, SizeRuns] | None
    """Runs at three particle sizes: finer, the trial's size (the trial's run comes first) and coarser. None for the
    fast model."""
    effects: tuple[Effect, ...]  # Effects of the inputs whose standard uncertainty is declared, computed with particles
    effect_scatter_mm: float | None
    """Standard deviation of an effect due to the scatter of single runs. None if it was not computed."""
    design_radius_mm: float | None  # Particle radius in the runs that gave the effects. None if there are no such runs.
    draws: InputDraws | None = None  # Runs of the fast model with varied inputs, used instead of ``effects``
    fast_mm: Numbers | None = None
    """Level computed by the fast model at ``s_mm``. None if that model is not valid here, or if it computed the trial's
    level."""
    unfit: Facts = ()  # Reasons why the fast model is not valid for the case
    mean_of: int = 1  # Number of runs whose mean is the level. Not in the file, since it is a setting of the trial.

    def __post_init__(self) -> None:
        """Raise InputError if runs of one size are copies of each other."""
        for size in self.sizes or ():
            seeds = [f"with seed + {number}" for number in range(len(size.levels_mm))]
            require_different(size.levels_mm, seeds, f"extra runs at a radius of {size.radius_mm:.4g} mm")

    def sizes_at(self, s_mm: Floats) -> Replicates | None:
        """Return the levels of the runs at each size, interpolated at ``s_mm``. Returns None if there are none."""
        if self.sizes is None:
            return None
        levels_mm = [along(s_mm, self.s_mm, size.levels_mm) for size in self.sizes]
        return Replicates([size.radius_mm for size in self.sizes], levels_mm, self.mean_of)

    def errors(self, s_mm: Floats, volume_level_mm: float | None) -> list[Component]:
        """Return the errors of the level at stations due to the numerics and the declared inputs.

        ``volume_level_mm`` is the change of level due to volume that the numerics gained. None if it is unknown.
        """
        sizes = self.sizes_at(s_mm)
        computed = [] if sizes is None else numerical_errors(sizes, volume_level_mm)
        return [*computed, *self.inputs_at(s_mm).errors()]

    def inputs_at(self, s_mm: Floats) -> Inputs:
        """Return the effects of the inputs, interpolated at ``s_mm``."""
        if self.draws is not None:
            return self.draws.inputs.interpolated(self.draws.s_mm, s_mm)
        levels_mm = np.reshape([effect.level_mm for effect in self.effects], (-1, len(self.s_mm)))
        standards = {effect.name: effect.standard for effect in self.effects}
        return Inputs("particles", standards, levels_mm, 0 * levels_mm, levels_mm[:0]).interpolated(self.s_mm, s_mm)

    def content(self) -> dict[str, Any]:
        """Return this spread as a dict that can be written to JSON. ``of`` reads the dict back."""
        content = asdict(self)
        del content["mean_of"]
        return {"version": 3, **content}

    @classmethod
    def of(cls, content: dict[str, Any]) -> Self:
        """Return a spread from the content of a JSON file. Raises ValueError if the content is not valid."""
        spread = TypeAdapter(cls).validate_python(content)
        levels_mm = [size.levels_mm for size in spread.sizes or ()]
        levels_mm += [effect.level_mm[None] for effect in spread.effects]
        levels_mm += [] if spread.fast_mm is None else [spread.fast_mm[None]]
        if any(levels.ndim != 2 or levels.shape[1] != len(spread.s_mm) for levels in levels_mm):
            raise ValueError("the levels of a run do not have the same length as s_mm")
        if any(len(size.levels_mm) < MIN_RUNS for size in spread.sizes or ()):
            raise ValueError(f"a particle size has fewer than {MIN_RUNS} runs")
        if spread.sizes is None and spread.draws is None:
            raise ValueError("there are neither runs of particles nor runs of the fast model")
        if (draws := spread.draws) is not None and draws.moved_mm.shape[1:] != draws.s_mm.shape:
            raise ValueError("moved_mm of the draws does not have the same length as their s_mm")
        return spread


def further_run_mm2(levels_mm: Floats, mean_of: int) -> float:
    """Return the variance of one further run's level about the mean of ``mean_of`` runs, averaged over the positions.

    ``levels_mm``, (runs, k), are the levels that show the scatter.
    """
    return float(levels_mm.var(axis=0, ddof=1).mean() * (1 + 1 / mean_of))


def require_different(levels_mm: Iterable[Floats], names: Sequence[str], where: str) -> None:
    """Raise InputError if two runs with different seeds have bit-identical levels.

    ``names`` contains the name of each level's run. The message begins with ``where``.
    """
    for (name, level_mm), (other, other_mm) in combinations(zip(names, levels_mm, strict=True), 2):
        if np.array_equal(level_mm, other_mm):
            raise InputError(
                f"{where}: the runs {name} and {other} have the same level to the last digit. They are copies, so they "
                "do not show the scatter of single runs. Give another solver.radius_mm, at which the seed changes the "
                "run."
            )
