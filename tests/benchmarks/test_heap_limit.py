"""What holds a heap of paste, and what interFoam is given and gives back."""

import numpy as np
import pytest

from benchmarks.heap_limit import holding_pa
from benchmarks.interfoam.__main__ import cases, columns
from benchmarks.interfoam.cases import write_case

WEIGHT_N_M3 = 16_579.0
X_MM = np.arange(0.25, 60.0, 0.5)


def test_a_vertical_face_stands_as_high_as_on_a_slip_circle():
    """3.83 tau / (rho g); cells of a tenth of it are 4 % off."""
    held_pa = holding_pa(X_MM, np.where(X_MM < 30, 10.0, 0.0), np.inf, WEIGHT_N_M3, cell_mm=1.0)
    assert WEIGHT_N_M3 * 0.010 / held_pa == pytest.approx(3.83, rel=0.05)


@pytest.mark.broad
def test_a_block_in_a_narrow_slot_is_held_by_its_walls():
    """Tall paste slides down as a plug once 2 tau / w falls below rho g."""
    held_pa = holding_pa(X_MM, np.where(X_MM < 40, 40.0, 0.0), 0.5, WEIGHT_N_M3, cell_mm=2.0)
    assert 0.8 < held_pa / (WEIGHT_N_M3 * 0.5e-3 / 2) < 1


@pytest.mark.parametrize("name", cases())
def test_a_case_starts_with_its_heap(name, tmp_path):
    case = cases()[name]
    write_case(case, tmp_path)
    values = (tmp_path / "0" / "alpha.paste").read_text().split("(", 1)[1].split(")", 1)[0].split()
    mesh = case.mesh
    share = np.array(values, dtype=float).reshape([axis.size_mm.size for axis in (mesh.z, mesh.y, mesh.x)])
    length, height = case.heap_mm
    level = (share * mesh.z.size_mm[:, None, None]).sum(axis=0).mean(axis=0)
    assert level @ mesh.x.size_mm == pytest.approx(length * height, rel=1e-5)
    assert columns(case, level)[1].sum() == pytest.approx(length * height, rel=1e-5)
