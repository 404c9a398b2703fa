"""Constrictions of a crack that its mean sections do not show: how much sealant they hold back, and where."""

from dataclasses import replace

import manifold3d
import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Floats, Outline, Solid
from simulate.hollow import solid_of
from simulate.slot.fill import HerschelBulkley
from simulate.slot.fitness import Fitness, fitness_of
from simulate.slot.narrows import goes_on, narrows
from simulate.slot.sections import sections_of
from tests.support.meshes import box
from tests.support.shapes import CLOSED, CUT, oblique_slot, pinched_crack, straight_slot, wandering_crack
from tests.support.small_fluids import path

LENGTH_MM, WIDTH_MM, DEPTH_MM = 40.0, 6.0, 12.0
BLOCK_MM = (-10.0, -15.0, 50.0, 15.0)


def stone(length_mm: float, width_mm: float, y_mm: float = 0.0, x_mm: float = 20.0) -> Floats:
    """A clockwise ring: a polygon of 48 corners if it is as long as wide, else a bar."""
    turn = -np.linspace(0.0, 2 * np.pi, 49)[:-1] if length_mm == width_mm else -np.pi * (np.arange(4) / 2 + 0.25)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    return [x_mm, y_mm] + ring / np.ptp(ring, axis=0) * [length_mm, width_mm]


def built(outline: Outline, *stones: Floats, depth_mm: object = DEPTH_MM, **shape: object) -> tuple[Solid, Outline]:
    outline = replace(outline, islands_mm=stones)
    settings = {"depth_mm": depth_mm, "tilt": "vertical", "wall_angle_deg": 0.0, **shape}
    return build_solid(outline, CrackShape.model_validate(settings)), outline


def slot_with(*stones: Floats, **shape: object) -> tuple[Solid, Outline]:
    return built(straight_slot(LENGTH_MM, WIDTH_MM, CUT), *stones, **shape)


def imported(*rooms: manifold3d.Manifold, filled: manifold3d.Manifold | None = None) -> tuple[Solid, Outline]:
    """A block less a slot and other rooms, as of a mesh; its sections are those of the slot alone."""
    low, high = (*BLOCK_MM[:2], -18.0), (*BLOCK_MM[2:], 0.0)
    slot = box((0.0, -3.0, -DEPTH_MM), (LENGTH_MM, 3.0, 1.0))
    body = box(low, high) - manifold3d.Manifold.batch_boolean([slot, *rooms], manifold3d.OpType.Add)
    solid = solid_of(body if filled is None else body + filled, BLOCK_MM, DEPTH_MM)
    plain, outline = slot_with()
    levels_mm = np.linspace(-DEPTH_MM, 0.0, 49)
    below_mm2 = np.tile(WIDTH_MM * (levels_mm + DEPTH_MM), (len(plain.sections.s_mm), 1))
    table = replace(plain.sections, levels_mm=levels_mm, below_mm2=below_mm2)
    return replace(solid, tilt="modelled", sections=table), replace(outline, ends=CLOSED)


def judged(crack: tuple[Solid, Outline], stress_pa: float = 5.0, fill: float = 0.5) -> Fitness:
    solid, outline = crack
    volume_ml = fill * solid.cavity_volume_mm3 / 1e3
    return fitness_of(solid, outline, path(outline, volume_ml), HerschelBulkley(1690.0, stress_pa, 0.3))


def test_a_bar_along_a_slot_holds_back_as_much_sealant_as_two_narrow_gaps():
    """The hold is that of area over perimeter, without corners; levels are off by the added length times the slope."""
    solid, outline = slot_with(stone(39.4, 0.5))
    sections = sections_of(outline, solid, 60, reach_per_mm=0.0)
    area_mm2 = sections.full_mm2 / 2
    height_mm = sections.height_mm(area_mm2)
    open_slot = sections.holding_mm(area_mm2, sections.wetted_mm(height_mm))
    gap = sections.holding_mm(2.75 * height_mm, 2.75 + 2 * height_mm)
    # Of 40 mm, 38.7 mm are in cells that count, with a tolerance of 0.05; a layer of a cut is 1 % of its depth.
    assert narrows(outline, solid, sections, 0.5).holds_mm == pytest.approx(
        38.7 * ((open_slot / gap)[30] - 1.05), rel=0.01
    )


@pytest.mark.parametrize(
    ("crack", "place_mm"),
    [
        (lambda: slot_with(stone(5.97, 5.97)), 20.0),
        (lambda: slot_with(stone(4.0, 4.0, 0.7)), 20.0),
        (lambda: slot_with(depth_mm=((9.8, 12.0), (9.9, 1.0), (10.1, 1.0), (10.2, 12.0))), 10.0),
        (lambda: imported(filled=box((30.0, -3.0, -12.0), (30.3, 2.99, 0.0))), 30.0),
        (lambda: imported(filled=box((1.0, -0.2, -12.0), (39.0, 0.2, 0.0))), None),
    ],
    ids=["closing stone", "stone aside", "dam", "wall with a slit", "bar in a mesh"],
)
def test_a_crack_with_a_hidden_constriction_is_unfit_for_the_fast_model(crack, place_mm):
    fitness = judged(crack())
    assert any("support a step" in why.text or "close the crack" in why.text for why in fitness.unfit)
    if place_mm is not None:
        assert fitness.narrowest_mm == pytest.approx(place_mm, abs=2.0)
        assert f"s = {fitness.narrowest_mm:.1f} mm" in str(fitness.unfit)


def test_a_stone_that_nearly_closes_the_crack_slows_a_liquid():
    assert "slow the flow" in str(judged(slot_with(stone(5.97, 5.97)), stress_pa=0.0).unfit)
    assert judged(slot_with(stone(3.0, 3.0)), stress_pa=0.0).unfit == ()


FIT = {
    "plain": lambda: slot_with(),
    "lean": lambda: slot_with(stone(0.6, 0.6), tilt="lean", wall_angle_deg=20.0),
    "step": lambda: slot_with(depth_mm=((0.0, 12.0), (20.0, 12.0), (20.01, 4.0), (40.0, 4.0))),
    "wanders": lambda: built(wandering_crack(0), tilt="flare", wall_angle_deg=5.5),
    "pinched": lambda: built(pinched_crack(0, neck_mm=1.0)),
    "oblique": lambda: built(oblique_slot(6.0), stone(0.6, 0.6, 20.0, 80.0)),
    "mesh": lambda: imported(),
    "mesh with a second slot": lambda: imported(box((-2.0, -15.0, -8.0), (-1.0, 15.0, 1.0))),
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
    assert goes_on(outline, solid) is None


def test_a_cavity_that_continues_under_the_face_is_unfit_for_the_fast_model():
    """The mouth ends at a roof. Even 3 % of the volume is too much there, although sections may leave out 5 %."""
    fitness = judged(imported(box((39.0, -3.0, -12.0), (48.0, 3.0, -3.0))))
    assert fitness.goes_on_mm == pytest.approx(LENGTH_MM)
    assert [why.key for why in fitness.unfit] == ["unfit.left-out", "unfit.goes-on"]
    small = judged(imported(box((39.0, -1.0, -12.0), (48.0, 1.0, -6.0))))
    assert [why.key for why in small.unfit] == ["unfit.goes-on"]
