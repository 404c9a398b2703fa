"""Sealant that changes with its age: its tables, their files, and their use in a run."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from sealtwin.core.errors import InputError
from simulate.fluid.viscosity import explicit_passes
from simulate.settings import Fluid, Nozzle, Solver
from simulate.setup.rheology import Rheology
from simulate.setup_checks import check_fit, rheology_of, solved_as
from tests.support.small_fluids import FRAME_S, as_paper, engine_with, in_rows, lattice, prepared, slot

SUPPORT_CM = 0.16
CURING = "age_s,viscosity_pa_s,yield_stress_pa\n0,0.05,0\n10,5,20\n"


def fluid(**table: Any) -> Fluid:
    return Fluid.model_validate_json(json.dumps({"freeze_after_s": "never", **table}))


def curve(**columns: Any) -> Fluid:
    return fluid(curve=columns)


def write(folder: Path, name: str, text: str) -> str:
    (folder / name).write_text(text, encoding="utf-8")
    return name


@pytest.mark.parametrize("mark", ["", "\ufeff"], ids=["plain", "Excel's UTF-8"])
def test_a_curve_interpolates_the_logarithm_of_viscosity_between_its_rows(tmp_path, mark):
    paste = fluid(curve=write(tmp_path, "paste.csv", mark + CURING)).loaded(tmp_path)
    assert np.array(paste.course.at_age(np.array([0.0, 5.0, 10.0, 99.0]))) == pytest.approx(
        np.array([[0.05, 0.5, 5.0, 5.0], [0.0, 10.0, 20.0, 20.0]])
    )
    assert paste.fresh == pytest.approx((0.05, 0.0))
    assert paste.yields
    assert not curve(age_s=[0, 1], viscosity_pa_s=[1, 2]).yields


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "no column age_s"),
        ("age_s|viscosity_pa_s\n0|1\n", "row 1: column 'age_s.viscosity_pa_s' is unknown.*commas"),
        ("age_s,age_s,viscosity_pa_s\n0,1,1\n", "row 1: column 'age_s' is unknown or occurs twice"),
        ("viscosity_pa_s\n1\n2\n", "no column age_s"),
        ("temperature_c,viscosity_pa_s\n9,1\n5,1\n", "column 'temperature_c' is unknown"),
        ("age_s,viscosity_pa_s\n0,1\n", "1 rows below the header; 2 to 1000"),
        ("age_s,viscosity_pa_s\n" + "".join(f"{n},1\n" for n in range(1001)), "1001 rows below the header"),
        ("age_s,viscosity_pa_s\n0,1\n\n1\n", "row 4: the row has 1 cells"),
        ("age_s,viscosity_pa_s\n0,1\n1,thick\n", "row 3, column viscosity_pa_s: 'thick'"),
        ("age_s,viscosity_pa_s\n0,1\n1,nan\n", "row 3, column viscosity_pa_s: nan is not in 1e-06 to 10000"),
        ("age_s,viscosity_pa_s\n0,1\n\n5,1\n5,2\n", "row 5, column age_s: 5 follows 5; .* larger"),
        ("age_s,viscosity_pa_s,yield_stress_pa\n0,1,2e4\n1,1,0\n", "row 2, .* 20000 is not in 0 to 10000"),
        ("x" * 200_001, "larger than 200000 bytes"),
        (None, "no such file"),
        (b"\xff\xfe\x00\x01", "UTF-8"),
    ],
)
def test_an_invalid_material_table_is_refused_with_the_reason(tmp_path, text, fault):
    if text is not None:
        (tmp_path / "material.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError, match=rf"material\.csv.*{fault}"):
        fluid(curve="material.csv").loaded(tmp_path)


@pytest.mark.parametrize(
    ("table", "fault"),
    [
        ({"U": 0.0}, "curve cannot .* U,"),
        ({"curve": {"temperature_c": [0, 1], "viscosity_pa_s": [1, 1]}}, "temperature_c"),
        ({"curve": {"age_s": [0, 1], "viscosity_pa_s": [1]}}, "viscosity_pa_s"),
        ({"curve": {"age_s": [0, 1], "viscosity_pa_s": [1, 1, 1]}}, "age_s, row 3: .* no value"),
    ],
)
def test_settings_that_conflict_with_a_curve_or_are_incomplete_are_refused(table, fault):
    with pytest.raises(ValidationError, match=fault):
        fluid(**{"curve": {"age_s": [0, 1], "viscosity_pa_s": [1, 1]}} | table)


def test_a_softening_curve_is_refused_if_particles_may_sleep():
    (solid, outline), nozzle = slot(), Nozzle(diameter_mm=2.4)
    soft = curve(age_s=[0, 1], viscosity_pa_s=[1, 1], yield_stress_pa=[9, 3])
    with pytest.raises(InputError, match=r"solver\.sleep = false"):
        check_fit(outline, solid, soft, as_paper({}), nozzle)
    check_fit(outline, solid, soft, as_paper({"sleep": False}), nozzle)


def test_the_material_table_of_a_run_has_the_curves_values_at_each_frame():
    """It has U and the yield stress up to the curve's last row or the run's end. A given D applies at every age."""
    paste = curve(age_s=[0, 0.1], viscosity_pa_s=[0.05, 0.5], yield_stress_pa=[0, 10])
    whole, short = rheology_of(paste, SUPPORT_CM, FRAME_S), rheology_of(paste, SUPPORT_CM, FRAME_S, frames=5)
    assert len(whole.course) == 1 + np.ceil(0.1 / FRAME_S)
    assert np.array_equal(short.course, whole.course[:6])
    seventh = 7 * FRAME_S / 0.1
    for age, pa_s, stress_pa in ((0, 0.05, 0.0), (7, 0.05 * 10**seventh, 10 * seventh), (-1, 0.5, 10)):
        constant = rheology_of(fluid(viscosity_pa_s=pa_s, yield_stress_pa=stress_pa), SUPPORT_CM, FRAME_S)
        assert whole.course[age] == pytest.approx(constant.course[0])
    weighted = rheology_of(paste.model_copy(update={"D_cm": 0.2}), SUPPORT_CM, FRAME_S)
    assert (weighted.wall_weight_cm, weighted.sticks) == (0.2, False)


STIFFENS = {"viscosity_pa_s": 1.0, "structuration_pa_per_s": 300.0}
TO_3000_PA = {"age_s": [0, 10], "viscosity_pa_s": [1, 1], "yield_stress_pa": [0, 3000]}


@pytest.mark.parametrize(
    ("key", "most", "asked", "allowed"),
    [
        # 100 rho g h at 1690 kg/m3 and h = 1.6 mm
        ("yield_stress_pa is 10000", 2650, {"viscosity_pa_s": 1, "yield_stress_pa": 1e4}, {"yield_stress_pa": 2650.0}),
        # In substeps of 1.81 ms 50 rho h^2 / dt in a second, or 30 in all
        ("structuration_pa_per_s: paste", 119, STIFFENS, {"structuration_pa_per_s": 119.0}),
        ("structuration_pa_per_s: paste", 119, STIFFENS, {"yield_stress_most_pa": 71.0}),
        (
            "curve: paste that gains 300",
            119,
            {"curve": TO_3000_PA},
            {"curve": TO_3000_PA | {"yield_stress_pa": [0, 1190]}},
        ),
    ],
)
def test_the_error_for_a_yield_stress_too_large_for_the_solver_gives_the_limit(key, most, asked, allowed):
    solver = Solver(radius_mm=0.4, substeps=4)
    with pytest.raises(InputError, match=rf"fluid\.{re.escape(key)}.* at most {most}\b"):
        solved_as(fluid(**asked), solver, FRAME_S, 1000)
    solved_as(fluid(**asked | allowed), solver, FRAME_S, 1000)


def test_a_curve_with_a_viscosity_too_large_to_compute_is_refused():
    stiff = fluid(curve={"age_s": [0, 1], "viscosity_pa_s": [1, 1e4]}, density_kg_m3=1.0)
    with pytest.raises(InputError, match=r"fluid\.curve reaches a viscosity of 10000"):
        solved_as(stiff, as_paper({}), FRAME_S, 1000)


@pytest.mark.parametrize(
    "asked",
    [
        {"viscosity_pa_s": 1.0, "yield_stress_pa": 9000.0},
        {"viscosity_pa_s": 1.0, "structuration_pa_per_s": 10.0},
        {"viscosity_pa_s": 9000.0},
        {"consistency_pa_s_n": 50.0, "flow_index": 0.2},
        {"U": 1e6, "D_cm": 0.3},
        {"curve": TO_3000_PA},
    ],
)
def test_a_sealant_that_needs_too_many_explicit_passes_is_refused(asked):
    """Earlier versions accepted up to 10,000 Pa, which would take 10,000 times as many passes as one of 1 Pa."""
    solver = Solver(radius_mm=0.4, substeps=4, viscosity_solve="explicit")
    with pytest.raises(InputError, match=r'solver\.viscosity_solve is "explicit": .*"implicit"'):
        solved_as(fluid(**asked), solver, FRAME_S, 1000)
    # 5,000 passes take 0.9 each of (33 + 16) nu dt / h^2, with tau / 0.002 per s for the viscosity.
    solved_as(fluid(viscosity_pa_s=1.0, yield_stress_pa=0.45), solver, FRAME_S, 1000)


@pytest.mark.parametrize(("law", "width_mm"), [({"viscosity_pa_s": 20.0}, 6.0), ({"U": 0.0, "D_cm": 3.0}, 1.6)])
def test_the_estimated_number_of_explicit_passes_is_an_upper_bound(law, width_mm):
    """Particles between walls need most passes, above all in corners. The estimate is at most twice their number."""
    paste, _ = solved_as(fluid(**law), Solver(radius_mm=0.4, substeps=4, viscosity_solve="explicit"), FRAME_S, 1000)
    half_mm = width_mm / 2 - 0.25
    points = lattice(np.array([0.2, -half_mm, -15.7]), np.array([5.8, half_mm, -6]), 0.65)
    engine = engine_with(points, slot(width_mm=width_mm), fluid=paste)
    prepared(engine)
    made = engine.viscosity.pass_explicit(engine.rows)
    passes = explicit_passes(paste, SUPPORT_CM, FRAME_S, 4, shears_per_s=(0.002, 100.0), frames=1000)
    assert 0.5 < made / passes <= 1.0


def test_particles_of_two_ages_interact_by_the_harmonic_mean_of_their_viscosities():
    """The weights of Eq. 5 between fresh and older particles are compared with those at one age."""
    points = lattice(np.array([0, -2.1, 20]), np.array([5, 2.1, 26]), 0.69)
    by_age = np.array([[2.0, 0.0], [6.0, 0.0]])
    sums = []
    for aged in (np.zeros(len(points), bool), points[:, 2] > 23):
        engine = engine_with(points, slot(depth_mm=4.0), fluid=Rheology(2.0, 0.0, by_age=by_age), substeps=1)
        prepared(engine)
        frames = np.where(aged, 0, 1)
        engine.state.frame.fill_(1)
        engine.state.particles.release_frame.assign(frames.astype(np.int32))
        engine.viscosity.measure_shear(engine.rows)
        engine.viscosity.pass_explicit(engine.rows)
        sums.append(engine.viscosity.system.restraint.numpy()[: len(points)].copy())
        height = points[in_rows(engine), 2]
    ratio = sums[1] / sums[0]
    assert ratio[height > 23 + 1.7] == pytest.approx(3.0, rel=1e-4)
    assert ratio[height < 23 - 1.7] == pytest.approx(1.0, rel=1e-4)
    # 2 * 2 * 6 / 8 = 3 is 1.5 times 2; with half of the neighbours aged the ratio is 1.25, or 1.5 by the plain mean.
    below = ratio[(height < 23) & (height > 22.2)]
    assert 1.05 < below.min() <= below.max() < 1.3
