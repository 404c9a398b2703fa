"""``import sealtwin as st``: what it offers, how it refuses, and that it leads from a photo to a report."""

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
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from matplotlib import pyplot

import sealtwin as st
from sealtwin.core.errors import InputError
from sealtwin.trial.trial_file import load_trial
from tests.support.evidence import axes_of
from tests.support.report_stubs import leave_out_figures, leave_out_pages
from tests.support.tiny_study import tiny_lab
from validate.report.write_report import REPORT

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


def test_importing_and_help_of_all_commands_load_no_library_and_none_of_the_stages():
    """What makes them instant: counted in modules, since a timed test fails on a busy machine."""
    script = "import sys, sealtwin\nfrom sealtwin.cli.app import app\ntry: app(['--help'])\n"
    script += f"except SystemExit: print([name for name in {HEAVY} if name in sys.modules])"
    shown = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert shown.endswith("[]\n")
    assert set(st.__all__) <= set(dir(st))
    with pytest.raises(AttributeError, match="'read_foto'"):
        st.read_foto  # noqa: B018  # pyright: ignore[reportAttributeAccessIssue]


@pytest.mark.parametrize("name", st.__all__)
def test_every_name_is_documented_and_takes_few_arguments_by_place(name):
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


def test_a_mask_may_be_an_array(way):
    photo, crack = way[:2]
    painted = np.zeros(photo.image.shape[:2], np.uint8)
    cv2.fillPoly(painted, [np.round(crack.outline_px).astype(np.int32)], (255,))
    masked = st.read_photo(photo.image, mm_per_px=0.1, mask=painted)
    assert st.trace_crack(masked, ENDS_PX).length_mm == pytest.approx(crack.length_mm, abs=0.5)
    with pytest.raises(InputError, match="roi_px"):
        st.trace_crack(masked, ENDS_PX, roi_px=[(0, 0), (199, 199)])


def test_python_is_warned_of_what_a_run_cannot_show(way):
    """A volume ratio of 2 came back without a word."""
    solver = st.Solver(**COARSE, settle_s=0.0)
    with pytest.warns(RuntimeWarning, match=r"Set a longer solver\.settle_s") as caught:
        run = st.inject(way[1], way[2], way[3], st.Fluid(U=30, D_cm=0.3), solver=solver)
    assert {warning.filename for warning in caught} == {__file__}
    texts = [str(warning.message) for warning in caught]
    assert [remark.text for remark in run.remarks] == [text for text in texts if text.startswith("fluid.")] != []


def test_python_is_warned_of_doubtful_readings():
    """A code for a missing reading was taken for a level without a word."""
    doubtful = np.column_stack([READINGS, READINGS[:, 1:]])
    doubtful[1, 1], doubtful[2, 3], doubtful[0, 4] = -999, 0, -2.2
    with pytest.warns(RuntimeWarning, match="-999 mm at s = .*a missing reading") as caught:
        readings = st.read_readings(doubtful)
    assert [str(warning.message) for warning in caught] == list(readings.doubts)
    assert len(caught) == 2


def test_without_progress_a_trial_says_each_thing_once_and_as_a_warning(lab, tmp_path, monkeypatch, capfd):
    leave_out_pages(monkeypatch)
    profile = tmp_path / "run" / "profile.csv"
    for sentences in (["fluid.U is "], ["fluid.U is ", "kept as profile.changed.csv"]):
        with pytest.warns(RuntimeWarning) as caught:
            st.run_trial(lab / "trial.toml", out=tmp_path / "run")
        texts = [str(warning.message) for warning in caught]
        assert [sum(sentence in text for text in texts) for sentence in sentences] == [1] * len(sentences)
        profile.write_bytes(profile.read_bytes() + b"\n")
    assert capfd.readouterr().err == ""


def test_a_run_is_the_trial_s_own(lab, way, tmp_path, monkeypatch):
    """From the records of the trial's folder: from those in memory, their last digits make another crowd."""
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
    with pytest.raises(InputError, match="belongs to the solid with"):
        st.measure_level(trial.run, trial.crack, deeper)
    with pytest.raises(InputError, match="belongs to the solid with"):
        st.plot_levels(trial.level, solid=deeper)

    content = json.loads(load_trial(lab / "trial.toml").model_dump_json(exclude_none=True))
    again = st.run_trial(content, source=lab, out=tmp_path / "run")
    assert (trial.redone, again.redone) == (("digitise", "simulate", "validate"), ())
    with pytest.raises(InputError, match=r"crack\.png"):
        st.run_trial(content, out=tmp_path / "other")
    assert not (tmp_path / "other").exists()


def test_the_level_of_several_seeds_is_their_mean(lab, tmp_path, monkeypatch):
    """In this process: a script without a guard runs it. ``seeds`` replaces the trial's own."""
    leave_out_pages(monkeypatch)
    with pytest.warns(RuntimeWarning, match="fluid.U is "):
        trial = st.run_trial(lab / "trial.toml", out=tmp_path / "run", seeds=2)
    assert trial.result.seeds is not None
    assert trial.result.seeds.seeds == (0, 1)
    table = np.genfromtxt(tmp_path / "run" / "level.csv", delimiter=",", names=True)
    assert trial.level.level_mm == pytest.approx((table["seed_0_mm"] + table["seed_1_mm"]) / 2, abs=1e-6)
    with pytest.warns(RuntimeWarning, match="fluid.U is "):
        again = st.run_trial(lab / "trial.toml", out=tmp_path / "run")
    assert again.result.seeds is None
    assert again.level.level_mm == pytest.approx(table["seed_0_mm"])


def test_a_report_says_what_nobody_declared(way, result, tmp_path, monkeypatch):
    leave_out_figures(monkeypatch)
    _, crack, solid, path, run = way
    page = st.write_report(tmp_path / "P01", crack, solid, path, run, result, note="by hand")
    assert {file.name for file in page.parent.iterdir()} == {*REPORT, "overlay.png", "straight.png"}
    report = json.loads((page.parent / "report.json").read_text(encoding="utf-8"))
    compared = report["comparison"]
    assert report["name"] == "P01"
    assert report["photo_data"] == compared["readings_data"] == compared["role"] == "undeclared"
    assert "alidated" not in str(report["headline"])
    (caution,) = [fact["text"] for fact in report["cautions"] if fact["key"] == "data.not-a-validation"]
    assert caution.count("not declared") == 3
    assert compared["errors"]["mean_error_mm"] == pytest.approx(result.mean_error_mm)
    assert compared["uncertainty"]["mean_error_interval_mm"] == pytest.approx(result.interval_95_mm)
    assert crack.sha256 in str(report["provenance"])


def test_a_report_is_of_one_run_and_leaves_a_run_folder_alone(way, result, tmp_path):
    _, crack, solid, path, run = way
    moved = replace(run, position_mm=run.position_mm + np.array([0, 0, 0.3]))
    with pytest.raises(InputError, match="result"):
        st.write_report(tmp_path / "P01", crack, solid, path, moved, result)
    (tmp_path / "manifest.json").write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match=str(tmp_path)):
        st.write_report(tmp_path, *way[1:])
    assert [file.name for file in tmp_path.iterdir()] == ["manifest.json"]


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
def test_records_of_two_cracks_are_refused_by_their_names(way, result, name):
    with pytest.raises(InputError, match=rf"^{name}: \w+\(.*length (60|14).* but \w+\(.*length (60|14)"):
        MIXTURES[name](*way[2:], result.level)


def test_records_of_the_same_numbers_are_of_one_crack(way, result):
    """A cell that is run again makes an equal crack, and so does a run folder."""
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


def test_declared_data_can_validate_a_run_without_leaks(lab, way):
    """Undeclared data keeps the others from it: the same comparison, declared, passes its gate."""
    crack, solid = st.trace_crack(st.read_photo(lab / "crack.png", mm_per_px=0.1, data="measured"), ENDS_PX), way[2]
    s_mm = np.linspace(0, crack.length_mm, 9)
    level = st.measure_level(way[4], crack, solid)
    table = np.column_stack([s_mm, np.interp(s_mm, level.s_mm, level.level_mm)])
    readings = st.read_readings(table, crack, solid, data="measured", role="held-out")
    assert st.compare(level, readings, crack, solid, gate_mm=50.0).headline[-1].text.startswith("Gate passed: ")
    leaking = st.measure_level(replace(way[4], escaped_particles=3), crack, solid)
    assert leaking.density_kg_m3 == way[4].settings["fluid"]["density_kg_m3"]
    assert st.compare(leaking, readings, crack, solid).verdict.startswith("Do not use this run: 3 particles")


def test_levels_are_drawn_on_a_figure(result):
    figure = st.plot_levels(result.level, result.readings, result)
    (axes,) = axes_of(figure)
    labels = [str(line.get_label()) for line in axes.lines]
    assert "simulated" in labels
    assert "caliper, UNDECLARED" in labels
    with pytest.raises(InputError, match="readings"):
        st.plot_levels()


def test_a_plot_leaves_the_plots_of_a_notebook_alone(result, monkeypatch):
    """Emulates the inline backend: its first figure switches interactive mode on, a cell shows pyplot's figures."""
    monkeypatch.setattr(pyplot, "figure", lambda *_, new=pyplot.figure, **how: (pyplot.ion(), new(**how))[1])
    pictures = []
    levels = partial(st.plot_levels, result.level)
    for cell in (levels, partial(pyplot.plot, [1, 2, 3]), levels):
        shown = cell()
        drawn = len(pyplot.get_fignums() if pyplot.isinteractive() else [])
        pictures.append(drawn + (getattr(shown, "_repr_html_", str)() or "").count("<img src="))
        pyplot.close("all")
    pyplot.ioff()
    assert pictures == [1, 1, 1]


def test_a_robot_s_path_is_confirmed(way, tmp_path):
    with pytest.raises(InputError, match="allow_automatic"):
        st.write_robot_program(tmp_path, replace(way[1], path_source="automatic"), way[3], {})


def test_a_fluid_does_not_freeze_unless_told_and_is_copied_without_being_checked_again():
    assert st.Fluid(U=30, D_cm=0.3, yield_stress_pa=12).freeze_after_s == "never"
    assert st.Fluid(U=np.float64(30), freeze_after_s=2).freeze_after_s == 2
    fluid = st.Fluid(U=1, curve=None, yield_stress_pa=np.float64(12))
    assert pickle.loads(pickle.dumps(fluid)) == copy.deepcopy(fluid) == fluid.model_copy() == fluid
    assert st.Fluid.model_construct(U=-1).U == -1
    assert fluid.model_fields_set == {"U", "D_cm", "yield_stress_pa"}


@pytest.mark.parametrize(
    ("call", "named"),
    [
        ("Fluid(U=-1)", "Fluid: U = -1"),
        ("Fluid(1.0)", "Fluid: give each setting by name, as in U="),
        ("read_photo('nowhere.jpg', mm_per_px=0.1)", "nowhere.jpg"),
        ("read_photo(photo.image)", "read_photo: no scale"),
        ("read_photo(photo.image / 255, mm_per_px=0.1)", "photo: an array"),
        ("read_photo(7, mm_per_px=0.1)", "photo: expected the path"),
        ("trace_crack(photo, [(1, 2), (3, '4')])", "trace_crack: ends_px.1.1"),
        ("build_solid(crack, 900)", "build_solid: depth_mm = 900"),
        ("plan_path(crack, solid, speed_mm_s=0)", "plan_path: speed_mm_s = 0"),
        ("trace_crack(photo, mm_per_px=0.2)", "trace_crack: there is no keyword mm_per_px"),
        ("inject(crack, solid, path, {'U': 30})", "inject: fluid is a dict"),
        ("inject(crack, solid, path, Fluid(U=1), seed=-1)", "inject: seed = -1"),
        ("inject(crack, solid, path, Fluid(U=1), threads=0)", "inject: threads = 0"),
        ("inject(crack, solid, path, Fluid(U=1), solver=Solver(radius_mm=5))", "solver.radius_mm is 5"),
        ("read_readings(READINGS[:, 0])", "shape"),
        ("read_readings(READINGS, unit='cm')", "read_readings: unit"),
        ("read_readings(READINGS + [90, 0, 0], crack, solid)", "readings: 90.5 mm in A2"),
        ("read_readings(READINGS, fitted=['fluid.u'])", "read_readings: fitted: fluid.u"),
        ("release_block(9, 9, 0, Fluid(U=1), duration_s=1, solver=Solver())", "release_block: height_mm = 0"),
        ("compare(None, None, None, None, gate_mm=-1)", "compare: gate_mm = -1"),
        ("sweep('nowhere.toml', {'fluid.U': [1]})", "nowhere.toml"),
        ("write_report('P01', crack, solid, None, run)", "write_report: path"),
        ("write_robot_program('P01', crack, path, {'name': 'x'})", "cell: taught"),
    ],
)
def test_a_refusal_begins_with_what_was_typed(way, call, named, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    records = dict(zip(("photo", "crack", "solid", "path", "run"), way, strict=True))
    with pytest.raises(st.InputError, match=re.escape(named)):
        eval(call, globals() | {name: getattr(st, name) for name in st.__all__} | records)
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def crack() -> st.CrackOutline:
    """A crack of given lines, as a notebook makes it."""
    line_mm = [(0.0, 20.0), (30.0, 22.0), (60.0, 18.0), (80.0, 20.0)]
    return st.crack_from_polyline(line_mm, 3.0, face_mm=(80, 40), data="synthetic")


@pytest.fixture(scope="module")
def solid(crack) -> st.Solid:
    return st.build_solid(crack, 16, tilt="vertical", wall_angle_deg=0)


@pytest.fixture(scope="module")
def path(crack, solid) -> st.PlannedPath:
    return st.plan_path(crack, solid, speed_mm_s=4, fill=0.6, trim_mm=10)


def test_the_fast_model_gives_the_level_of_a_run_by_it_and_a_report(crack, solid, path, tmp_path, monkeypatch):
    """``inject`` runs the same model, searches for settings that are fit beside it, and so takes longer."""
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


def test_rows_are_readings_and_with_names_they_are_read_as_a_sheet(crack, solid):
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
        ([[10, 9], [30, -9], [50, 9]], None, "as_written=['B3']"),
        ("s_mm,foo\n10,4\n30,4\n", None, "columns={'levels': ...}"),
    ],
)
def test_what_is_wrong_with_readings_is_told_by_keywords(tmp_path, rows, columns, words):
    """Of lists it named the trial's [readings] and a pairing.csv, and a file in a scratch folder."""
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


def test_columns_of_a_file_are_its_table(tmp_path, crack, solid):
    sheet = tmp_path / "sheet.csv"
    sheet.write_text("a,b,c\n10,7,-4.0\n30,8,-3.0\n", encoding="utf-8")
    readings = st.read_readings(sheet, crack, solid, columns={"s": "A", "levels": ["C"]}, unit="mm", quantity="level")
    assert readings.level_mm == pytest.approx([-4.0, -3.0])
    with pytest.raises(st.InputError, match="for a file, columns must be a table"):
        st.read_readings(sheet, columns=["s_mm", "level_mm"])


def test_records_show_their_main_figures_in_a_line_and_a_table(crack, result):
    length = f"{crack.length_mm:.1f} mm"
    assert repr(crack).startswith(f"CrackOutline(length {length}, mean width 3.00 mm, ends open and open")
    assert repr(result).startswith(f"LevelComparison(mean error {result.mean_error_mm:.2f} mm (")
    assert repr(st.Fluid(U=30, D_cm=0.3)) == "Fluid(U=30.0, D_cm=0.3)"
    assert f"<td>{length}</td>" in crack._repr_html_()


def test_levels_on_axes_of_the_users_leave_title_colours_and_limits_alone(crack, solid, path):
    figure, ax = pyplot.subplots()
    ax.set(title="mine", ylim=(-30.0, 5.0))
    (drawn,) = ax.plot([0, 80], [-1, -1])
    for stress_pa in (3, 6):
        level = st.fill_fast(crack, solid, path, st.Fluid(viscosity_pa_s=2, yield_stress_pa=stress_pa))
        st.plot_levels(level, solid=solid, ax=ax, label=f"{stress_pa} Pa")
    colours = {line.get_label(): line.get_color() for line in ax.get_lines()}
    assert len({colours["3 Pa"], colours["6 Pa"], drawn.get_color()}) == 3
    assert (ax.get_title(), ax.get_title(loc="left"), ax.get_ylim()[0]) == ("mine", "", -30.0)
    pyplot.close(figure)
