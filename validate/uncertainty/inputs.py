"""Uncertain inputs: what each does to the level, by a design of runs or by draws of all inputs together."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from sealtwin.core.records import Floats, Numbers
from validate.comparison import InputDrawsRecord, InputEffect
from validate.settings import Differences
from validate.uncertainty.budget import Component, draws_for, normals
from validate.units import LABELS, MODELS

RUNS = 1_000  # A standard deviation by so many is known to 2 %


def drawn_inputs(names: Iterable[str], runs: int = RUNS) -> Floats:
    """Return draws of each input in standard uncertainties from its value, (runs, n), the same for a name each time."""
    return np.hstack([normals(name, 1, runs) for name in names])


def along(s_mm: Floats, known_mm: Floats, levels_mm: Floats) -> Floats:
    """Return levels, (runs, k), at other places."""
    return np.array([np.interp(s_mm, known_mm, level_mm) for level_mm in levels_mm])


@dataclass(frozen=True)
class Effect:
    """The effect of one input's standard uncertainty on the simulated level."""

    name: str  # Name of the setting in [uncertainty]
    standard: float  # Declared standard uncertainty, in the unit that the name ends with
    level_mm: Numbers  # Change of the level for an input larger by that, at the s where levels are compared


@dataclass(frozen=True)
class Inputs:
    """Effects of all moved inputs, by one model."""

    model: Differences
    effects: tuple[Effect, ...]
    curved_mm: tuple[Floats, ...] = ()
    """Change that adds to each effect for an input larger and for one smaller alike; empty by particles."""
    together_mm: Floats = field(default_factory=lambda: np.zeros((1, 1)))
    """Draws of the change by all inputs beyond the sum of each alone, (draws, k)."""

    def at(self, known_mm: Floats, s_mm: Floats) -> "Inputs":
        """Return the effects at ``s_mm``, where they are at ``known_mm``."""
        effects = tuple(replace(one, level_mm=np.interp(s_mm, known_mm, one.level_mm)) for one in self.effects)
        if not self.curved_mm:
            return replace(self, effects=effects)
        curved_mm = tuple(np.interp(s_mm, known_mm, one) for one in self.curved_mm)
        return replace(self, effects=effects, curved_mm=curved_mm, together_mm=along(s_mm, known_mm, self.together_mm))

    def errors(self) -> list[Component]:
        """Return the errors of the levels at the stations where the effects are."""
        found = []
        for number, one in enumerate(self.effects):
            z = normals(one.name, 1, draws_for(len(one.level_mm)))
            draws_mm = z * one.level_mm + (z**2 * self.curved_mm[number] if self.curved_mm else 0.0)
            found.append(self._component(LABELS["inputs"][one.name][0], draws_mm, f"uncertainty.{one.name}"))
        if self.curved_mm:
            count, (runs, stations) = draws_for(self.together_mm.shape[1]), self.together_mm.shape
            # Runs in another order than those of each input alone.
            order = np.random.default_rng(stations).permutation(np.arange(count) % runs)
            found.append(self._component("inputs together", self.together_mm[order], ""))
        return found

    def _component(self, name: str, draws_mm: Floats, setting: str) -> Component:
        name = f"{name}, {MODELS[self.model]}"
        return Component(name, "declared", draws_mm, shared=True, kind="inputs", setting=setting)

    def reported(self, x: Floats) -> tuple[tuple[InputEffect, ...], float]:
        """Return each effect on the mean level over x, where the effects are, and the variance's share by no one alone.

        The variance of a normal z times a plus z squared times b is a^2 + 2 b^2.
        """

        def mean(levels_mm: Floats) -> Floats:
            return np.trapezoid(levels_mm, x) / (x[-1] - x[0])

        straight = np.array([mean(one.level_mm) for one in self.effects])
        curved = np.array([mean(one) for one in self.curved_mm]) if self.curved_mm else np.zeros(len(straight))
        alone = straight**2 + 2 * curved**2
        together = float(np.var(mean(self.together_mm))) if self.curved_mm else 0.0
        whole = alone.sum() + together
        shares = alone / whole if whole else alone
        effects = tuple(
            InputEffect(
                name=one.name,
                standard=one.standard,
                mean_level_mm=float(change),
                largest_mm=float(np.abs(one.level_mm).max()),
                share=float(share),
                model=self.model,
            )
            for one, change, share in zip(self.effects, straight, shares, strict=True)
        )
        return effects, together / whole if whole else 0.0


@dataclass(frozen=True)
class InputDraws:
    """Runs of the fast model with inputs drawn together, against its run with the inputs as they are."""

    s_mm: Numbers  # (k,)
    standards: dict[str, float]  # Declared standard uncertainty of each input by its name in [uncertainty]
    moved_mm: Numbers  # (runs, k): level less that of the inputs as they are
    unfit: tuple[str, ...]  # Reasons why the case is outside the model's domain, a sentence each

    @cached_property
    def inputs(self) -> Inputs:
        """The effect of each input alone, by least squares of parabolas that start from the inputs as they are.

        The draws of two inputs are independent, so that the variance of one's parabola, over that of all runs, is its
        first-order index (Saltelli et al. 2008, Global Sensitivity Analysis, 1.2).
        """
        z = drawn_inputs(self.standards, len(self.moved_mm))
        terms = np.hstack([z, z**2])
        found = np.linalg.lstsq(terms, self.moved_mm)[0]
        straight, curved = np.split(found, 2)
        declared = zip(self.standards.items(), straight, strict=True)
        effects = tuple(Effect(*one, level_mm) for one, level_mm in declared)
        return Inputs("slot", effects, tuple(curved), self.moved_mm - terms @ found)

    def recorded(self, together: float) -> InputDrawsRecord:
        """Return how many runs there are and what they are fit for, as comparison.json has it."""
        return InputDrawsRecord(runs=len(self.moved_mm), together=together, unfit=self.unfit)
