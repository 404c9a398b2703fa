"""Constrictions of a crack that its mean sections do not show: how much sealant they hold back, and where."""

from dataclasses import replace

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Outline, Solid
from simulate.slot.fill import HerschelBulkley
from simulate.slot.fitness import Fitness, fitness_of
from simulate.slot.narrows import narrows
from simulate.slot.sections import sections_of
from tests.support.shapes import CUT, oblique_slot, pinched_crack, straight_slot, wandering_crack
from tests.support.small_fluids import path

LENGTH_MM, WIDTH_MM, DEPTH_MM = 40.0, 6.0, 12.0
STONE_MM = np.array([[19.7, -0.3], [19.7, 0.3], [20.3, 0.3], [20.3, -0.3]])
DAM = ((9.8, 12.0), (9.9, 1.0), (10.1, 1.0), (10.2, 12.0))


def built(outline: Outline, *, depth_mm: object = DEPTH_MM, **shape: object) -> tuple[Solid, Outline]:
    settings = {"depth_mm": depth_mm, "tilt": "vertical", "wall_angle_deg": 0.0, **shape}
    return build_solid(outline, CrackShape.model_validate(settings)), outline


def a_slot(**shape: object) -> tuple[Solid, Outline]:
    return built(straight_slot(LENGTH_MM, WIDTH_MM, CUT), **shape)


def judged(crack: tuple[Solid, Outline], stress_pa: float = 5.0, fill: float = 0.5) -> Fitness:
    solid, outline = crack
    volume_ml = fill * solid.cavity_volume_mm3 / 1e3
    return fitness_of(solid, outline, path(outline, volume_ml), HerschelBulkley(1690.0, stress_pa, 0.3))


@pytest.mark.parametrize("stress_pa", [5.0, 0.0])
def test_a_dam_in_a_crack_is_unfit_for_the_fast_model(stress_pa):
    fitness = judged(a_slot(depth_mm=DAM), stress_pa=stress_pa)
    assert [why.key for why in fitness.unfit] == ["unfit.narrow"]
    assert fitness.narrowest_mm == pytest.approx(10.0, abs=2.0)
    assert f"s = {fitness.narrowest_mm:.1f} mm" in str(fitness.unfit)


def test_a_crack_with_stones_and_a_mesh_are_unfit_for_the_fast_model():
    solid, outline = a_slot()
    stones = replace(outline, islands_mm=(STONE_MM,))
    for crack in ((solid, stones), (replace(solid, tilt="modelled"), outline)):
        assert [why.key for why in judged(crack).unfit] == ["unfit.stones-or-mesh"]
    assert judged((solid, outline)).unfit == ()


FIT = {
    "plain": lambda: a_slot(),
    "lean": lambda: a_slot(tilt="lean", wall_angle_deg=20.0),
    "step": lambda: a_slot(depth_mm=((0.0, 12.0), (20.0, 12.0), (20.01, 4.0), (40.0, 4.0))),
    "wanders": lambda: built(wandering_crack(0), tilt="flare", wall_angle_deg=5.5),
    "pinched": lambda: built(pinched_crack(0, neck_mm=1.0)),
    "oblique": lambda: built(oblique_slot(6.0)),
}


@pytest.mark.parametrize("crack", FIT.values(), ids=FIT)
def test_a_crack_without_a_severe_constriction_is_fit_for_the_fast_model(crack):
    """At a slope of 0.45, the model's steepest, the step would be a third of the allowed step."""
    solid, outline = crack()
    sections = sections_of(outline, solid, 60, reach_per_mm=0.0)
    for fill in (0.2, 0.5, 0.9):
        places = narrows(outline, solid, sections, fill)
        assert 0.45 * places.holds_mm < 0.4, fill
        assert places.drags_mm < 0.1 * outline.length_mm, fill
