"""The mass balance: parts that add up to the dispensed volume."""

from pathlib import Path

import numpy as np
import pytest

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.records import Run
from sealtwin.core.run_figures import RunHealth
from tests.shapes import straight_slot
from validate.metrics.volumes import mass_balance
from validate.settings import Readings

OUTLINE = straight_slot(80.0, 3.0)
SOLID = build_solid(OUTLINE, CrackShape(depth_mm=16.0, tilt="vertical"))
RADIUS_MM = 0.4
WET = Readings(file=Path("P.csv"), data="measured", role="held-out", state="wet")


def run(position_mm, spilled=()) -> Run:
    position_mm = np.array(position_mm, dtype=float)
    over = np.isin(np.arange(len(position_mm)), spilled)
    zero = np.zeros_like(position_mm)
    return Run(position_mm, zero, over, RADIUS_MM, 2.0, {}, zero[:, 0], 0, "cpu", RunHealth())


def test_parts_add_up_to_what_was_dispensed():
    """Ten particles of 2 mm³: five below the face, three above, two over the edge; the settled ones fill 15 mm³."""
    heights_mm = [-8.0, -6, -4, -2, -1, 0.5, 0.6, 0.7, -90, -90]
    balance = mass_balance(
        run([[10.0 * i, 0, z] for i, z in enumerate(heights_mm)], spilled=(8, 9)), SOLID, 0.75, 90.0, WET
    )
    assert (balance.dispensed_mm3, balance.spilled_mm3, balance.lost_mm3) == (20.0, 4.0, 1.0)
    assert balance.in_crack_mm3 == pytest.approx(15 * 5 / 8)
    parts = balance.in_crack_mm3 + balance.above_mm3 + balance.spilled_mm3 + balance.lost_mm3
    assert parts == pytest.approx(balance.dispensed_mm3)


def test_a_film_beside_the_mouth_is_a_footprint_and_a_heap_over_it_is_none():
    """A disc of 0.4 mm covers 0.50 mm²; on cells of 0.2 mm it is read within a third, a row of them within 10 %."""
    # Its disc reaches over the edge of the mouth, at 1.5 mm; its middle does not.
    heap = run([[40.0, 1.25, 0.3]])
    assert mass_balance(heap, SOLID, 1.0, 90.0, WET).footprint_mm2 == 0.0
    beside = run([[40.0, 6.0, 0.3]])
    assert mass_balance(beside, SOLID, 1.0, 90.0, WET).footprint_mm2 == pytest.approx(np.pi * 0.16, rel=1 / 3)
    row = run([[x, 6.0, 0.3] for x in np.arange(20, 60, 0.4)])
    assert mass_balance(row, SOLID, 1.0, 90.0, WET).footprint_mm2 == pytest.approx(40 * 0.8, rel=0.15)
    assert mass_balance(run([[40.0, 6.0, -40.0]], spilled=(0,)), SOLID, 1.0, 90.0, WET).footprint_mm2 == 0.0


def test_cured_sealant_was_more_when_it_was_given():
    cured = WET.model_copy(update={"state": "cured", "shrinkage_percent": 10.0})
    sealant = run([[40.0, 6.0, 0.3]])
    assert mass_balance(sealant, SOLID, 1.0, 90.0, cured).readings_when_dispensed_mm3 == pytest.approx(100.0)
    assert mass_balance(sealant, SOLID, 1.0, 90.0, WET).readings_when_dispensed_mm3 == 90.0
