"""Mistakes in Python: each error names the function and the argument, and a type checker finds what types show."""

import json
import subprocess
import sys
import warnings

import numpy as np
import pytest

import sealtwin as st
from tests.support.paths import ROOT

with warnings.catch_warnings(action="ignore"):
    crack = st.crack_from_polyline([(0, 20), (30, 24), (60, 20)], 3.0)
    solid = st.build_solid(crack, 16)
    path = st.plan_path(solid)
    paste = st.Fluid(viscosity_pa_s=2.0, yield_stress_pa=6.0)
    run = st.fill_fast(path, paste)
    rows = np.array([(s_mm, -4.0) for s_mm in (5, 20, 35, 55)])
    readings = st.read_readings(rows, solid)
    result = st.compare(run, readings)
    deeper = st.build_solid(crack, 20)

MISTAKES = [
    ("st.trace_crack('photo.jpg')", "trace_crack: photo ", True),
    ("st.read_photo(None, mm_per_px=0.1)", "read_photo: photo ", True),
    ("st.build_solid(None, 16)", "build_solid: crack ", True),
    ("st.build_solid(16, crack)", "build_solid: crack ", True),
    ("st.build_solid(crack)", "build_solid: .*'depth_mm'", True),
    ("st.build_solid(crack, '16 mm')", "build_solid: depth_mm = '16 mm'", True),
    ("st.build_solid(crack, [16, 14, 12])", "build_solid: depth_mm.0 = 16", True),
    ("st.build_solid(crack, 16, tilt='Vertical')", "build_solid: tilt = 'Vertical'", True),
    ("st.plan_path(crack)", "plan_path: solid ", True),
    ("st.plan_path(crack, solid)", "plan_path: too many .* the arguments are solid", True),
    ("st.build_solid(crack, 'vertical', 16)", "build_solid: too many .* without a name only crack, depth_mm.", True),
    ("st.plan_path(solid, speed=4)", "plan_path: .* speed; did you mean speed_mm_s", True),
    ("st.plan_path(solid, speed_mm_s='fast')", "plan_path: speed_mm_s = 'fast'", True),
    ("st.plan_path(solid, volume_ml='3 ml')", "plan_path: volume_ml = '3 ml'", True),
    ("st.fill_fast(solid, paste)", "fill_fast: path ", True),
    ("st.fill_fast(path, paste, nozzle=2.4)", "fill_fast: nozzle ", True),
    ("st.fill_fast(path, paste, settle_s='2 s')", "fill_fast: settle_s ", True),
    ("st.inject(path)", "inject: .*'fluid'", True),
    ("st.inject(path, {'viscosity_pa_s': 2})", "inject: fluid ", True),
    ("st.inject(path, paste, seed=-1)", "inject: seed = -1", False),
    ("st.inject(path, paste, device='gpu')", "inject: device gpu", False),
    ("st.compare(readings, run)", "compare: run ", True),
    ("st.compare(run, rows)", "compare: readings ", True),
    ("st.compare(run, st.read_readings(rows, deeper))", "compare: readings belong to", False),
    ("st.compare(run, readings, gate={'mean_eror_mm': 1.6})", "compare: gate: mean_error_mm", False),
    ("st.compare(run, readings, gate=1.6)", "compare: gate ", True),
    ("st.read_readings(rows, crack)", "read_readings: solid ", True),
    ("st.read_readings(rows, solid, unit='feet')", "read_readings: unit = 'feet'", True),
    ("st.plot_levels(None)", "plot_levels: shown ", True),
    ("st.plot_levels(result, ax=3)", "plot_levels: ax ", True),
    ("st.write_report('report', path)", "write_report: shown ", True),
    ("st.write_report(result, 'report')", "write_report: folder ", True),
    ("st.write_robot_program('robot', run, 'cell.toml')", "write_robot_program: path ", True),
    ("st.open_run(None)", "open_run: folder ", True),
    ("st.Fluid(viscosity=3)", "Fluid: viscosity: .*viscosity_pa_s", True),
]
"""Calls, what their errors say, and whether a type checker finds them."""


pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")  # Of the fast model


@pytest.mark.parametrize(("call", "named"), [mistake[:2] for mistake in MISTAKES])
def test_a_mistake_is_an_error_that_names_the_function_and_the_argument(call, named, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(st.InputError, match=f"^{named}"):
        eval(call)
    assert not [*tmp_path.iterdir()]


def test_arrays_of_records_cannot_be_changed():
    for array in (run.level.level_mm, readings.level_mm, path.flow_mm3_s, solid.vertices_mm, crack.left_wall_mm):
        with pytest.raises(ValueError, match="read-only"):
            array -= 5


def test_scalars_of_numpy_are_numbers():
    zero_d = st.plan_path(solid, speed_mm_s=np.array(4), trim_mm=np.float32(8))
    assert np.array_equal(zero_d.t_s, st.plan_path(solid, speed_mm_s=4, trim_mm=8).t_s)
    assert st.build_solid(crack, np.array(16.0)).depth_mm == 16
    assert st.fill_fast(path, paste, settle_s=np.array(2)).level.level_mm.tolist() == run.level.level_mm.tolist()


@pytest.mark.slow
def test_a_type_checker_finds_the_mistakes_that_types_can_express_and_no_other(tmp_path):
    records = {"crack": "CrackOutline", "solid": "SampleSolid", "path": "PlannedPath", "paste": "Fluid"}
    records |= {"run": "SimulatedRun", "readings": "LevelReadings", "result": "LevelComparison"}
    records["deeper"] = "SampleSolid"
    arguments = ", ".join(f"{name}: st.{kind}" for name, kind in records.items())
    head = ["import numpy as np; import sealtwin as st", f"def calls(rows: np.ndarray, {arguments}):"]
    right = (
        "st.build_solid(crack, [[0, 16], (60, 14)], tilt='lean', wall_angle_deg=[5, 6])",
        "st.build_solid(crack, np.array([[0.0, 16.0]]))",
        "st.plan_path(solid, speed_mm_s=4, volume_ml='cavity', trim_mm=(5, 10))",
        "st.inject(path, paste, solver=st.Solver(radius_mm=0.45), seed=3, gradient_deg=2)",
        "st.compare(run.level, st.read_readings(rows, solid, columns=['s_mm', 'level_mm']), gate={'mean_error_mm': 1})",
        "st.trace_crack(st.read_photo('a.jpg', mm_per_px=0.1, face_mm=[1, 2]), [(1, 2), (3, 4)], crack=2)",
    )
    calls = [call for call, _, _ in MISTAKES] + [*right]
    (tmp_path / "calls.py").write_text("\n".join([head[0], "\n    ".join([head[1], *calls]), ""]), encoding="utf-8")
    (tmp_path / "pyrightconfig.json").write_text(
        json.dumps({"extraPaths": [str(ROOT)], "typeCheckingMode": "standard", "pythonVersion": "3.11"}), "utf-8"
    )
    words = [sys.executable, "-m", "basedpyright", "--outputjson", "--project", str(tmp_path)]
    words += ["--pythonpath", sys.executable]
    answer = json.loads(subprocess.run(words, capture_output=True, text=True, check=False).stdout)
    faults = {one["range"]["start"]["line"] - len(head): one["message"] for one in answer["generalDiagnostics"]}
    expected = {number for number, (_, _, typed) in enumerate(MISTAKES) if typed}
    assert {calls[number]: text for number, text in faults.items() if number not in expected} == {}
    assert [calls[number] for number in expected - faults.keys()] == []
