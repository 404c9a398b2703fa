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
def run(lab):
    """Coarse particles in a drawn crack of 12 mm."""
    crack = st.trace_crack(st.read_photo(lab / "crack.png", mm_per_px=0.1), ENDS_PX)
    solid = st.build_solid(crack, 8, tilt="vertical")
    path = st.plan_path(solid, volume_ml=0.08, speed_mm_s=20, trim_mm=1)
    return st.inject(path, st.Fluid(U=30, D_cm=0.3), solver=st.Solver(**COARSE))


@pytest.fixture(scope="module")
def result(run):
    return st.compare(run, st.read_readings(READINGS, run.path.solid), gate={"mean_error_mm": 50.0})


def test_a_result_has_what_it_was_computed_from(run, result):
    assert result.level is run.level
    assert result.level.run is run
    assert result.readings.solid is run.path.solid
    assert run.path.solid.crack.photo.size_px == (200, 200)
    assert run.fluid.U == 30
    assert list(run.level)[3] == {"s_mm": run.level.s_mm[3], "level_mm": run.level.level_mm[3]}
    assert run.path.solid.mesh().volume == pytest.approx(run.path.solid.mesh().convex_hull.volume, rel=0.5)
    assert run.path.solid.mesh().is_watertight


def test_records_cannot_be_changed_and_are_compared_by_identity(run, result):
    assert result != result.model_copy()
    for record in (result.readings, run.level, run, run.path, run.path.solid, run.path.solid.crack):
        again = pickle.loads(pickle.dumps(record))
        arrays = {name: value for name, value in vars(again).items() if isinstance(value, np.ndarray)}
        assert arrays
        assert record == copy.deepcopy(record) != again
        for name, value in arrays.items():
            assert np.array_equal(value, getattr(record, name), equal_nan=True)
            for array in (value, getattr(record, name)):
                with pytest.raises(ValueError, match="read-only"):
                    array -= 5


def test_a_pickle_holds_no_photo(run, tmp_path):
    crack = run.path.solid.crack
    assert len(pickle.dumps(crack)) < 100_000 < len(pickle.dumps(crack.photo))
    again = pickle.loads(pickle.dumps(run))
    st.compare(again, st.read_readings(READINGS, run.path.solid))
    with pytest.raises(InputError, match=r"^write_report: shown has a crack without its photo"):
        st.write_report(tmp_path, again)


def test_tab_completion_shows_no_names_of_pydantic(result):
    for record, name in ((st.Fluid(U=1), "U"), (result, "mean_error_mm")):
        assert name in dir(record)
        assert not {"construct", "parse_obj", "model_dump"} & {*dir(record)}


def test_a_loop_gives_a_warning_once_and_an_error_filter_still_applies():
    crack = st.crack_from_polyline([(0, 20), (60, 20)], 3.0)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for _ in range(3):
            st.build_solid(crack, 0.5)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
    assert len(caught) == 1
    assert caught[0].filename == __file__
    for action, count in (("always", 3), ("default", 1)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter(action)
            for _ in range(3):
                st.build_solid(crack, 0.6)
        assert len(caught) == count


def test_a_mask_that_is_given_as_an_array_is_traced(run):
    crack = run.path.solid.crack
    photo = crack.photo
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


def test_run_trial_gives_the_same_run_as_inject(lab, run, tmp_path, monkeypatch):
    """Both read the records of the trial's folder; the last digits of those in memory would give other particles."""
    leave_out_pages(monkeypatch)
    done = st.run_trial(lab / "trial.toml", out=tmp_path / "run")
    fluid, solver = st.Fluid(U=30, D_cm=0.3, freeze_after_s=0.2), st.Solver(**COARSE, settle_s=0.0)
    trial = st.open_run(tmp_path / "run")
    anew = st.inject(trial.path, fluid, solver=solver, nozzle=st.Nozzle(diameter_mm=2.4))
    assert trial.run.position_mm == pytest.approx(anew.position_mm, abs=1e-5), "particles.csv rounds"
    assert trial.level.level_mm == pytest.approx(anew.level.level_mm, abs=1e-5)
    assert trial.run.settings == anew.settings
    assert trial.run.fluid.model_dump() == fluid.model_dump()
    assert trial.crack.left_wall_mm == pytest.approx(run.path.solid.crack.left_wall_mm, abs=1e-4)
    assert done.result.model_dump_json() == trial.result.model_dump_json()
    assert trial.report.is_file()
    st.compare(trial.run, st.read_readings(READINGS, run.path.solid))
    with pytest.raises(InputError, match="compare: readings belong to"):
        st.compare(trial.level, st.read_readings(READINGS, st.build_solid(trial.crack, 9, tilt="vertical")))
    with pytest.raises(InputError, match="compare: all readings are within"):
        st.compare(trial.level, st.read_readings([[0.3, -2.0], [0.8, -2.1], [1.2, -2.0]]))

    content = json.loads(load_trial(lab / "trial.toml").model_dump_json(exclude_none=True))
    with pytest.raises(InputError, match=r"trial\.toml, so"):
        st.run_trial(content, source=lab, out=tmp_path / "run")
    first, again = (st.run_trial(content, source=lab, out=tmp_path / "again") for _ in range(2))
    assert (first.redone, again.redone) == (("digitise", "simulate", "validate"), ())
    with pytest.raises(InputError, match=r"readings\.csv: not found"):
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


def test_write_report_refuses_a_run_folder_as_target(run, tmp_path):
    (tmp_path / "manifest.json").write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match=str(tmp_path)):
        st.write_report(tmp_path, run)
    assert [file.name for file in tmp_path.iterdir()] == ["manifest.json"]


def test_inject_accepts_the_slope_of_the_sample_as_a_keyword(run):
    sloping = st.inject(run.path, st.Fluid(U=30, D_cm=0.3), solver=st.Solver(**COARSE), gradient_deg=20)
    assert sloping.settings["sample"]["gradient_deg"] == 20
    assert sloping.position_mm[:, 0].mean() < run.position_mm[:, 0].mean() - 0.1


def test_readings_of_an_equal_solid_are_accepted(run, result):
    """A notebook's cell that is run again makes an equal crack, and so does a run folder."""
    again = st.trace_crack(run.path.solid.crack.photo, ENDS_PX)
    lines = ("centreline_mm", "left_wall_mm", "right_wall_mm")
    stored = replace(again, **{name: np.round(getattr(again, name), 5) for name in lines})
    readings = replace(result.readings, solid=st.build_solid(stored, 8, tilt="vertical"))
    assert st.compare(run, readings).mean_error_mm == pytest.approx(result.mean_error_mm, abs=1e-3)


def test_declared_readings_pass_the_gate_unless_particles_escaped(lab, run):
    """The other tests compare undeclared data, which cannot pass a gate."""
    crack = st.trace_crack(st.read_photo(lab / "crack.png", mm_per_px=0.1, data="measured"), ENDS_PX)
    measured = replace(run, path=replace(run.path, solid=st.build_solid(crack, 8, tilt="vertical")))
    s_mm, level = np.linspace(0, crack.length_mm, 9), measured.level
    table = np.column_stack([s_mm, np.interp(s_mm, level.s_mm, level.level_mm)])
    readings = st.read_readings(table, measured.path.solid, data="measured", role="held-out")
    gate = {"mean_error_mm": 50.0}
    assert st.compare(level, readings, gate=gate).headline[-1].text.startswith("Gate passed: ")
    leaking = replace(measured, escaped_particles=3)
    assert st.compare(leaking, readings).verdict.startswith("Do not use this run: 3 particles")


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
        ("read_photo(photo.image)", "read_photo: no scale"),
        ("read_photo(photo.image / 255, mm_per_px=0.1)", "photo: the array"),
        ("inject(path, Fluid(curve='none.csv'))", "none.csv: no such file"),
        ("inject(path, Fluid(U=1), solver=Solver(radius_mm=5))", "solver.radius_mm is 5"),
        ("read_readings(__file__, columns=['s_mm', 'level_mm'])", "columns must be a table"),
        ("read_readings(READINGS, fitted=['fluid.u'])", "read_readings: fitted: fluid.u"),
        ("compare(run, read_readings(READINGS), gate={'mean_error_mm': -1})", "compare: gate: mean_error_mm = -1"),
        ("sweep('nowhere.toml', {'fluid.U': [1]})", "nowhere.toml"),
        ("write_robot_program('P01', path, {'name': 'x'})", "cell: taught"),
    ],
)
def test_the_error_for_each_wrong_argument_names_the_argument(run, call, named, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    crack = run.path.solid.crack
    records = {"photo": crack.photo, "crack": crack, "path": run.path, "run": run}
    with pytest.raises(st.InputError, match=re.escape(named)):
        eval(call, globals() | {name: getattr(st, name) for name in st.__all__} | records)
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def crack() -> st.CrackOutline:
    """A crack made of lines, as in a notebook."""
    line_mm = [(0.0, 20.0), (30.0, 22.0), (60.0, 18.0), (80.0, 20.0)]
    return st.crack_from_polyline(line_mm, 3.0, face_mm=(80, 40), data="synthetic")


@pytest.fixture(scope="module")
def solid(crack) -> st.SampleSolid:
    return st.build_solid(crack, 16, tilt="vertical", wall_angle_deg=0)


@pytest.fixture(scope="module")
def path(solid) -> st.PlannedPath:
    return st.plan_path(solid, speed_mm_s=4, fill=0.6, trim_mm=10)


def test_fill_fast_gives_the_same_level_as_inject_with_the_fast_model(solid, path, tmp_path, monkeypatch):
    """``inject`` runs the same model and takes longer, since it also searches for suitable settings."""
    filled = st.fill_fast(path, PASTE)
    run = st.inject(path, PASTE, solver=st.Solver(model="slot"))
    assert np.array_equal(filled.level.level_mm, run.level.level_mm)
    assert filled.dispensed_volume_mm3 == pytest.approx(path.dispensed_mm3)
    leave_out_figures(monkeypatch)
    readings = st.read_readings([[float(s), -6.0] for s in range(5, 80, 5)], solid)
    page = st.write_report(tmp_path, st.compare(filled, readings))
    assert "The fast model, which is for screening, is" in page.read_text(encoding="utf-8")
    report = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert report["comparison"].keys() == st.compare(filled, readings).model_dump().keys() - {"level", "readings"}
    with pytest.warns(RuntimeWarning, match="slope"):
        st.fill_fast(path, st.Fluid(viscosity_pa_s=2.0, yield_stress_pa=40.0))


def test_rows_of_numbers_and_rows_with_column_names_give_the_same_readings(solid):
    plain = st.read_readings([[10, -4.0, -4.2], [30, -3.0, np.nan], [50, -2.0, -2.2]], solid)
    assert plain.level_mm == pytest.approx([-4.1, -3.0, -2.1])
    names = ["s [cm]", "depth 1 [mm]", "depth 2 [mm]", "remark"]
    rows: list[Any] = [[1, 4, 4.2, "ok"], [3, 3, None, ""], [5, 2, 2.2, ""]]
    named = st.read_readings(rows, solid, columns=names)
    assert named.s_mm == pytest.approx([10, 30, 50])
    assert named.repeats_mm == pytest.approx(plain.repeats_mm, nan_ok=True)
    for rows, columns, words in (
        ([[1, 2], [3]], None, "readings has the shape"),
        ([[1, 2], [3, 4, 5]], ["s_mm", "level_mm"], "row 2 of the readings has 3"),
        ([[1, "x"]], ["s_mm", "level_mm"], "readings: B2 'x'"),
    ):
        with pytest.raises(st.InputError, match=words):
            st.read_readings(rows, solid, columns=columns)


@pytest.mark.parametrize(
    ("rows", "columns", "words"),
    [
        ([[10, 4], [30, 4]], ["s_mm", "reading"], "Give unit=...."),
        ([[10, 4], [30, 4]], ["s_mm", "reading"], "Give quantity=...."),
        ([[10, 9], [30, -9], [50, 9]], ["s_mm", "level_mm"], "as_written=['B3']"),
        ("s_mm,foo,bar\n10,4,5\n30,4,5\n", None, "columns={'levels': ...}"),
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
