"""The Python interface, ``import sealtwin as st``, from a photo to a report."""

import copy
import inspect
import json
import pickle
import re
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import sealtwin as st
from sealtwin.core.errors import InputError
from sealtwin.trial.trial_file import load_trial
from tests.support.report_stubs import leave_out_figures, leave_out_pages
from tests.support.tiny_study import tiny_lab

ENDS_PX = [[40, 101], [160, 98]]
READINGS = np.array(
    [[0.5, 2.0, 2.1], [2, 2.0, 2.0], [4, 2.0, 1.9], [7, 1.5, 1.4], [10, 1.0, 1.1], [12, 1.0, 1.0], [13.5, 1, np.nan]]
)
READINGS[:, 1:] *= -1
COARSE = {"radius_mm": 0.45, "substeps": 2}
pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")  # Of a crack that is narrow, and runs that end early
PASTE = st.Fluid(viscosity_pa_s=2.0, yield_stress_pa=6.0)
HEAVY = (
    *("warp", "cv2", "trimesh", "scipy", "skimage", "matplotlib", "numpy", "pydantic"),
    *("digitise", "simulate", "validate", "sealtwin.api"),
)


def test_importing_sealtwin_or_printing_help_loads_no_heavy_library():
    """Without these modules both are instant. A timed test would fail on a busy machine."""
    script = "import sys, sealtwin\nfrom sealtwin.cli.app import app\ntry: app(['--help'])\n"
    script += f"except SystemExit: print([name for name in {HEAVY} if name in sys.modules])"
    shown = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert shown.endswith("[]\n")
    assert set(st.__all__) <= set(dir(st))
    with pytest.raises(AttributeError, match="'read_foto'"):
        st.read_foto  # noqa: B018


@pytest.mark.parametrize("name", st.__all__)
def test_every_public_function_is_documented_and_has_at_most_6_positional_arguments(name):
    lines = (inspect.getdoc(getattr(st, name)) or "").splitlines()
    assert len(" ".join(lines).split()) >= 3
    if inspect.isclass(getattr(st, name)):
        return
    parameters = inspect.signature(getattr(st, name)).parameters
    assert sum(parameter.kind is not inspect.Parameter.KEYWORD_ONLY for parameter in parameters.values()) <= 6
    assert {"Parameters", "Returns", "Raises"} <= {*lines}
    documented = {word for line in lines for word in line.partition(" : ")[0].split(", ")}
    assert parameters.keys() <= documented


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    return tiny_lab(tmp_path_factory.mktemp("lab") / "tiny").parent


@pytest.fixture(scope="module")
def way(lab):
    """Photo, crack, solid, path and run: a drawn crack of 12 mm and coarse particles."""
    photo = st.read_photo(lab / "crack.png", mm_per_px=0.1)
    crack = st.trace_crack(photo, ENDS_PX)
    solid = st.build_solid(crack, 8, tilt="vertical")
    path = st.plan_path(crack, solid, volume_ml=0.08, speed_mm_s=20, trim_mm=1)
    return (
        photo,
        crack,
        solid,
        path,
        st.inject(crack, solid, path, st.Fluid(U=30, D_cm=0.3), solver=st.Solver(**COARSE)),
    )


@pytest.fixture(scope="module")
def result(way):
    _, crack, solid, _, run = way
    readings = st.read_readings(READINGS, crack, solid)
    return st.compare(st.measure_level(run, crack, solid), readings, crack, solid, gate_mm=50.0)


def test_a_mask_that_is_given_as_an_array_is_traced(way):
    photo, crack = way[:2]
    painted = np.zeros(photo.image.shape[:2], np.uint8)
    cv2.fillPoly(painted, [np.round(crack.outline_px).astype(np.int32)], (255,))
    masked = st.read_photo(photo.image, mm_per_px=0.1, mask=painted)
    assert st.trace_crack(masked, ENDS_PX).length_mm == pytest.approx(crack.length_mm, abs=0.5)
    with pytest.raises(InputError, match="roi_px"):
        st.trace_crack(masked, ENDS_PX, roi_px=[(0, 0), (199, 199)])


def test_doubtful_readings_give_python_warnings():
    """The code -999 for a missing reading was once taken for a level without a warning."""
    doubtful = np.column_stack([READINGS, READINGS[:, 1:]])
    doubtful[1, 1], doubtful[2, 3], doubtful[0, 4] = -999, 0, -2.2
    with pytest.warns(RuntimeWarning, match="-999 mm at s = .*a missing reading") as caught:
        readings = st.read_readings(doubtful)
    assert [str(warning.message) for warning in caught] == list(readings.doubts)
    assert len(caught) == 2


def test_run_trial_without_progress_gives_each_warning_once(lab, tmp_path, monkeypatch, capfd):
    leave_out_pages(monkeypatch)
    profile = tmp_path / "run" / "profile.csv"
    for sentences in (["fluid.U is "], ["fluid.U is ", "kept as profile.changed.csv"]):
        with pytest.warns(RuntimeWarning) as caught:
            st.run_trial(lab / "trial.toml", out=tmp_path / "run")
        texts = [str(warning.message) for warning in caught]
        assert [sum(sentence in text for text in texts) for sentence in sentences] == [1] * len(sentences)
        profile.write_bytes(profile.read_bytes() + b"\n")
    assert capfd.readouterr().err == ""


def test_run_trial_gives_the_same_run_as_inject(lab, way, tmp_path, monkeypatch):
    """Both read the records of the trial's folder; the last digits of those in memory would give other particles."""
    leave_out_pages(monkeypatch)
    trial = st.run_trial(lab / "trial.toml", out=tmp_path / "run")
    fluid, solver = st.Fluid(U=30, D_cm=0.3, freeze_after_s=0.2), st.Solver(**COARSE)
    run = st.inject(trial.crack, trial.solid, trial.path, fluid, solver=solver)
    assert trial.run.position_mm == pytest.approx(run.position_mm, abs=1e-5), "particles.csv rounds"
    level = st.measure_level(run, trial.crack, trial.solid)
    assert trial.level.level_mm == pytest.approx(level.level_mm, abs=1e-5)
    assert trial.run.settings == run.settings
    assert trial.crack.left_wall_mm == pytest.approx(way[1].left_wall_mm, abs=1e-4)
    assert None not in (trial.mean_error_mm, trial.interval_95_mm)
    assert trial.report.is_file()
    deeper = st.build_solid(trial.crack, 9, tilt="vertical")
    with pytest.raises(InputError, match="to the solid with"):
        st.measure_level(trial.run, trial.crack, deeper)
    with pytest.raises(InputError, match="to the solid with"):
        st.plot_levels(trial.level, solid=deeper)

    content = json.loads(load_trial(lab / "trial.toml").model_dump_json(exclude_none=True))
    again = st.run_trial(content, source=lab, out=tmp_path / "run")
    assert (trial.redone, again.redone) == (("digitise", "simulate", "validate"), ())
    with pytest.raises(InputError, match=r"crack\.png"):
        st.run_trial(content, out=tmp_path / "other")
    assert not (tmp_path / "other").exists()


def test_the_level_of_several_seeds_is_the_mean_of_their_levels(lab, tmp_path, monkeypatch):
    """The runs start no process, so that a script needs no main guard. ``seeds`` replaces the trial's setting."""
    leave_out_pages(monkeypatch)
    with pytest.warns(RuntimeWarning, match="fluid.U is "):
        trial = st.run_trial(lab / "trial.toml", out=tmp_path / "run", seeds=2)
    assert trial.result.seeds is not None
    assert trial.result.seeds.seeds == (0, 1)
    table = np.genfromtxt(tmp_path / "run" / "level.csv", delimiter=",", names=True)
    assert trial.level.level_mm == pytest.approx((table["seed_0_mm"] + table["seed_1_mm"]) / 2, abs=1e-6)


def test_write_report_refuses_the_result_of_another_run_or_a_run_folder_as_target(way, result, tmp_path):
    _, crack, solid, path, run = way
    moved = replace(run, position_mm=run.position_mm + np.array([0, 0, 0.3]))
    with pytest.raises(InputError, match="result"):
        st.write_report(tmp_path / "P01", crack, solid, path, moved, result)
    (tmp_path / "manifest.json").write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match=str(tmp_path)):
        st.write_report(tmp_path, *way[1:])
    assert [file.name for file in tmp_path.iterdir()] == ["manifest.json"]


def test_inject_accepts_the_slope_of_the_sample_as_a_keyword(way):
    _, crack, solid, path, run = way
    fluid, solver = st.Fluid(U=30, D_cm=0.3), st.Solver(**COARSE)
    sloping = st.inject(crack, solid, path, fluid, solver=solver, gradient_deg=20)
    assert sloping.settings["sample"]["gradient_deg"] == 20
    assert sloping.position_mm[:, 0].mean() < run.position_mm[:, 0].mean() - 0.1


OTHER = st.crack_from_polyline([(0, 20), (60, 20)], 2.0)
ROWS = np.array([(s_mm, -4.0) for s_mm in (5, 20, 35, 55)])
MIXTURES: dict[str, Callable[..., object]] = {
    "compare": lambda solid, path, run, level: st.compare(level, st.read_readings(ROWS, OTHER), OTHER, solid),
    "fill_fast": lambda solid, path, run, level: st.fill_fast(OTHER, solid, path, PASTE),
    "inject": lambda solid, path, run, level: st.inject(OTHER, solid, path, PASTE),
    "measure_level": lambda solid, path, run, level: st.measure_level(run, OTHER, solid),
    "plan_path": lambda solid, path, run, level: st.plan_path(OTHER, solid),
    "plot_levels": lambda solid, path, run, level: st.plot_levels(level, st.read_readings(ROWS, OTHER)),
    "read_readings": lambda solid, path, run, level: st.read_readings(ROWS, OTHER, solid),
    "write_report": lambda solid, path, run, level: st.write_report("none", OTHER, solid, path, run),
    "write_robot_program": lambda solid, path, run, level: st.write_robot_program("none", OTHER, path, "none"),
}
RECORDS = {"crack", "solid", "path", "run", "level", "readings", "result"}
FUNCTIONS = filter(inspect.isfunction, map(st.__getattr__, st.__all__))
TAKE_TWO = [one.__name__ for one in FUNCTIONS if len(RECORDS & {*inspect.signature(one).parameters}) > 1]


@pytest.mark.parametrize("name", TAKE_TWO)
def test_a_call_that_mixes_records_of_two_cracks_is_refused(way, result, name):
    with pytest.raises(InputError, match=rf"^{name}: \w+\(.*length (60|14).* but \w+\(.*length (60|14)"):
        MIXTURES[name](*way[2:], result.level)


def test_equal_records_are_accepted_as_records_of_the_same_crack(way, result):
    """A notebook's cell that is run again makes an equal crack, and so does a run folder."""
    photo, _, solid, _, run = way
    again = st.trace_crack(photo, ENDS_PX)
    lines = ("centreline_mm", "left_wall_mm", "right_wall_mm")
    stored = replace(again, **{name: np.round(getattr(again, name), 5) for name in lines})
    st.compare(result.level, result.readings, stored, st.build_solid(again, 8, tilt="vertical"))
    faster = st.plan_path(again, solid, volume_ml=0.08, speed_mm_s=40, trim_mm=1)
    higher = replace(result.level, level_mm=result.level.level_mm + 1)
    for mix, match in (
        (
            lambda: st.write_report("none", again, solid, faster, run),
            "write_report: .* belongs to the path with length",
        ),
        (lambda: st.compare(result.readings, result.level, again, solid), "compare: level is a LevelReadings"),
        (lambda: st.plot_levels(higher, result=result), "plot_levels: result"),
    ):
        with pytest.raises(InputError, match=f"^{match}"):
            mix()


def test_declared_readings_pass_the_gate_unless_particles_escaped(lab, way):
    """The other tests compare undeclared data, which cannot pass a gate."""
    crack, solid = st.trace_crack(st.read_photo(lab / "crack.png", mm_per_px=0.1, data="measured"), ENDS_PX), way[2]
    s_mm = np.linspace(0, crack.length_mm, 9)
    level = st.measure_level(way[4], crack, solid)
    table = np.column_stack([s_mm, np.interp(s_mm, level.s_mm, level.level_mm)])
    readings = st.read_readings(table, crack, solid, data="measured", role="held-out")
    assert st.compare(level, readings, crack, solid, gate_mm=50.0).headline[-1].text.startswith("Gate passed: ")
    leaking = st.measure_level(replace(way[4], escaped_particles=3), crack, solid)
    assert leaking.density_kg_m3 == way[4].settings["fluid"]["density_kg_m3"]
    assert st.compare(leaking, readings, crack, solid).verdict.startswith("Do not use this run: 3 particles")


def test_a_fluid_does_not_freeze_by_default():
    assert st.Fluid(U=30, D_cm=0.3, yield_stress_pa=12).freeze_after_s == "never"
    assert st.Fluid(U=np.float64(30), freeze_after_s=2).freeze_after_s == 2
    fluid = st.Fluid(U=1, curve=None, yield_stress_pa=np.float64(12))
    assert pickle.loads(pickle.dumps(fluid)) == copy.deepcopy(fluid) == fluid.model_copy() == fluid
    assert st.Fluid.model_construct(U=-1).U == -1
    assert fluid.model_fields_set == {"U", "D_cm", "yield_stress_pa"}


@pytest.mark.parametrize(
    ("call", "named"),
    [
        ("Fluid(1.0)", "Fluid: give each setting by name, as in U="),
        ("read_photo('nowhere.jpg', mm_per_px=0.1)", "nowhere.jpg"),
        ("read_photo(photo.image)", "read_photo: no scale"),
        ("read_photo(photo.image / 255, mm_per_px=0.1)", "photo: the array"),
        ("read_photo(7, mm_per_px=0.1)", "photo: expected the path of a file"),
        ("build_solid(crack, 900)", "build_solid: depth_mm = 900"),
        ("trace_crack(photo, mm_per_px=0.2)", "trace_crack: there is no keyword mm_per_px"),
        ("inject(crack, solid, path, {'U': 30})", "inject: fluid is a dict"),
        ("inject(crack, solid, path, Fluid(U=1), seed=-1)", "inject: seed = -1"),
        ("inject(crack, solid, path, Fluid(U=1), threads=0)", "inject: threads = 0"),
        ("inject(crack, solid, path, Fluid(U=1), crossfall_deg=46)", "inject: crossfall_deg = 46"),
        ("inject(crack, solid, path, Fluid(curve='none.csv'))", "none.csv: no such file"),
        ("inject(crack, solid, path, Fluid(U=1), solver=Solver(radius_mm=5))", "solver.radius_mm is 5"),
        ("read_readings(READINGS[:, 0])", "shape"),
        ("read_readings(READINGS, unit='cm')", "read_readings: unit"),
        ("read_readings(__file__, columns=['s_mm', 'level_mm'])", "columns must be a table"),
        ("plot_levels()", "readings"),
        ("read_readings(READINGS, fitted=['fluid.u'])", "read_readings: fitted: fluid.u"),
        ("release_block(9, 9, 0, Fluid(U=1), duration_s=1, solver=Solver())", "release_block: height_mm = 0"),
        ("compare(None, None, None, None, gate_mm=-1)", "compare: gate_mm = -1"),
        ("sweep('nowhere.toml', {'fluid.U': [1]})", "nowhere.toml"),
        ("write_report('P01', crack, solid, None, run)", "write_report: path"),
        ("write_robot_program('P01', crack, path, {'name': 'x'})", "cell: taught"),
    ],
)
def test_the_error_for_each_wrong_argument_names_the_argument(way, call, named, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    records = dict(zip(("photo", "crack", "solid", "path", "run"), way, strict=True))
    with pytest.raises(st.InputError, match=re.escape(named)):
        eval(call, globals() | {name: getattr(st, name) for name in st.__all__} | records)
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def crack() -> st.CrackOutline:
    """A crack made of lines, as in a notebook."""
    line_mm = [(0.0, 20.0), (30.0, 22.0), (60.0, 18.0), (80.0, 20.0)]
    return st.crack_from_polyline(line_mm, 3.0, face_mm=(80, 40), data="synthetic")


@pytest.fixture(scope="module")
def solid(crack) -> st.Solid:
    return st.build_solid(crack, 16, tilt="vertical", wall_angle_deg=0)


@pytest.fixture(scope="module")
def path(crack, solid) -> st.PlannedPath:
    return st.plan_path(crack, solid, speed_mm_s=4, fill=0.6, trim_mm=10)


def test_fill_fast_gives_the_same_level_as_inject_with_the_fast_model(crack, solid, path, tmp_path, monkeypatch):
    """``inject`` runs the same model and takes longer, since it also searches for suitable settings."""
    level = st.fill_fast(crack, solid, path, PASTE)
    with pytest.warns(RuntimeWarning, match="fast model"):
        run = st.inject(crack, solid, path, PASTE, solver=st.Solver(model="slot", settle_s=2.0))
    assert np.array_equal(level.level_mm, st.measure_level(run, crack, solid).level_mm)
    assert level.dispensed_mm3 == pytest.approx(path.dispensed_mm3)
    leave_out_figures(monkeypatch)
    readings = st.read_readings([[float(s), -6.0] for s in range(5, 80, 5)], crack, solid)
    page = st.write_report(tmp_path, crack, solid, path, level, st.compare(level, readings, crack, solid))
    assert "The fast model, which is for screening, is" in page.read_text(encoding="utf-8")
    with pytest.warns(RuntimeWarning, match="slope"):
        st.fill_fast(crack, solid, path, st.Fluid(viscosity_pa_s=2.0, yield_stress_pa=40.0))


def test_rows_of_numbers_and_rows_with_column_names_give_the_same_readings(crack, solid):
    plain = st.read_readings([[10, -4.0, -4.2], [30, -3.0, np.nan], [50, -2.0, -2.2]], crack, solid)
    assert plain.level_mm == pytest.approx([-4.1, -3.0, -2.1])
    names = ["s [cm]", "depth 1 [mm]", "depth 2 [mm]", "remark"]
    rows: list[Any] = [[1, 4, 4.2, "ok"], [3, 3, None, ""], [5, 2, 2.2, ""]]
    named = st.read_readings(rows, crack, solid, columns=names)
    assert named.s_mm == pytest.approx([10, 30, 50])
    assert named.repeats_mm == pytest.approx(plain.repeats_mm, nan_ok=True)
    for rows, columns, words in (
        ([[1, 2], [3]], None, "same length"),
        ([[1, 2], [3]], ["s_mm", "level_mm"], "row 2 of the readings has 1"),
        ([[1, "x"]], ["s_mm", "level_mm"], "readings: B2 'x'"),
    ):
        with pytest.raises(st.InputError, match=words):
            st.read_readings(rows, crack, solid, columns=columns)


@pytest.mark.parametrize(
    ("rows", "columns", "words"),
    [
        ([[10, 4], [30, 4]], ["s_mm", "reading"], "Give unit=...."),
        ([[10, 4], [30, 4]], ["s_mm", "reading"], "Give quantity=...."),
        ([[10, 9], [30, -9], [50, 9]], ["s_mm", "level_mm"], "as_written=['B3']"),
        ("s_mm,foo\n10,4\n30,4\n", None, "columns={'levels': ...}"),
    ],
)
def test_messages_about_readings_name_python_keywords_and_no_trial_settings(tmp_path, rows, columns, words):
    """Messages about lists once named the trial's [readings], a pairing.csv and a file in a scratch folder."""
    if isinstance(rows, str):
        (tmp_path / "sheet.csv").write_text(rows, encoding="utf-8")
        rows = tmp_path / "sheet.csv"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            text = "\n".join(st.read_readings(rows, columns=columns).doubts)
        except st.InputError as fault:
            text = str(fault)
    assert words in text
    assert all(str(one.message) in text for one in caught)
    assert not re.search(r"pairing|\[readings|lab\.toml|trial", text)
    assert isinstance(rows, Path) or tempfile.gettempdir() not in text


def test_records_show_their_main_figures_as_text_and_as_html(crack, result):
    length = f"{crack.length_mm:.1f} mm"
    assert repr(crack).startswith(f"CrackOutline(length {length}, mean width 3.00 mm, ends open and open")
    assert repr(result).startswith(f"LevelComparison(mean error {result.mean_error_mm:.2f} mm (")
    assert repr(st.Fluid(U=30, D_cm=0.3)) == "Fluid(U=30.0, D_cm=0.3)"
    assert f"<td>{length}</td>" in crack._repr_html_()
