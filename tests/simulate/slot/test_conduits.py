"""The flow through a section, compared with closed forms and with its numerical derivative."""

import numpy as np
import pytest

from simulate.shear_law import PlaneFlow
from simulate.slot.fill import HerschelBulkley, conduits
from simulate.slot.sections import Trapezoids


def flow_of(paste: HerschelBulkley, width_mm: float, height_mm: float, push: float) -> float:
    """Mean speed in a rectangular section, in mm/s."""
    one = np.ones(2)
    sections = Trapezoids(
        s_mm=np.array([0.0, 1.0]),
        floor_mm=width_mm * one,
        mouth_mm=width_mm * one,
        depth_mm=2 * height_mm * one,
        slant=2 * one,
        bottom_mm=-2 * height_mm * one,
        reach_per_mm=1.0,
        reach_mm=0.0,
    )
    area_mm2 = width_mm * height_mm * one
    flow, _ = conduits(paste, sections, area_mm2, height_mm * one, np.array([0])).flow_mm3_s(np.array([push]))
    return float(flow[0]) / area_mm2[0]


@pytest.mark.parametrize(
    ("width_mm", "height_mm", "shape_mm2", "rel"),
    [(2.0, 1e4, 2.0**2 / 12, 1e-3), (1e5, 2.0, 2.0**2 / 3, 1e-3), (4.0, 2.0, 0.035144 * 4.0**2, 3e-3)],
    ids=["plates", "film", "half of a square duct"],
)
def test_a_newtonian_fluid_has_the_mean_speed_of_the_closed_form(width_mm, height_mm, shape_mm2, rel):
    """The mean speed is the shape's factor times G / mu; area over perimeter alone gives 0.59 of it in the duct."""
    speed_mm_s = flow_of(HerschelBulkley(1e3, 0.0, 0.5), width_mm, height_mm, 3.0)
    assert speed_mm_s == pytest.approx(shape_mm2 * 3.0 / 0.5, rel=rel)


@pytest.mark.parametrize("index", [0.5, 1.0, 1.5])
@pytest.mark.parametrize("yields", [0.0, 0.2, 0.8])
def test_paste_between_plates_has_the_mean_speed_of_the_integrated_profile(index: float, yields: float):
    """The slope of the profile is u' = ((G y - tau) / K)^(1/n)."""
    half_mm, push, thick = 1.5, 8.0, 0.7
    stress_pa = yields * push * half_mm
    y = np.linspace(0.0, half_mm, 200_001)
    shear = (np.maximum(push * y - stress_pa, 0.0) / thick) ** (1 / index)
    # Integrated by parts: the mean speed is the mean of shear times the distance from the middle.
    wanted = np.trapezoid(shear * y, y) / half_mm
    got = flow_of(HerschelBulkley(1e3, stress_pa, thick, index), 2 * half_mm, 1e5, push)
    assert got == pytest.approx(wanted, rel=1e-3)


def test_a_wall_share_scales_yield_stress_and_consistency():
    """With a wall share of 0.4 paste flows as paste of 0.4 times the stresses between rough walls."""
    slides = flow_of(HerschelBulkley(1e3, 5.0, 0.5, 0.7, wall_share=0.4), 3.0, 4.0, 6.0)
    assert slides == pytest.approx(flow_of(HerschelBulkley(1e3, 2.0, 0.2, 0.7), 3.0, 4.0, 6.0), rel=1e-12)
    assert slides > 0


def test_the_flow_is_0_below_the_yield_stress_with_an_exact_derivative_above():
    through = PlaneFlow(np.array([4.0]), np.array([3.0]), 1.0)
    assert not np.any([through.flow_mm3_s(np.array([push])) for push in (-3.999, 0.0, 3.999)])
    for push in (-9.0, -4.001, 4.001, 5.0, 40.0):
        low, high = (through.flow_mm3_s(np.array([push + off]))[0] for off in (-1e-6, 1e-6))
        flow, stiff = through.flow_mm3_s(np.array([push]))
        assert stiff[0] == pytest.approx((high[0] - low[0]) / 2e-6, rel=1e-2)
        assert np.sign(flow[0]) == np.sign(push)
