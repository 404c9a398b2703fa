"""Trial files, whose faults are reported with their keys before anything runs, and drafts of trials."""

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest

from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Sample
from sealtwin.trial.starter_files import SEALANT, TRIAL, begin_trial, write_starter
from sealtwin.trial.trial_file import UNMEASURED, Trial, drafted, load_trial, trial_text, with_settings
from simulate.material_file import Material
from simulate.settings import LAWS, Nozzle, Solver
from simulate.setup.release_schedule import plan_releases
from simulate.setup_checks import check_fit, rheology_of
from tests.support.ingested_lab import edit
from tests.support.paths import FIXTURE
from tests.support.small_fluids import injected, path, sample_of, slot
from validate.readings.read_readings import read_readings
from validate.settings import Declared


def _trial(tmp_path, *changes):
    """The starter with lines replaced: (old, new) each."""
    text = TRIAL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "trial.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("depth_mm = 16.0", "dept_mm = 16.0", ["crack.dept_mm", "did you mean 'depth_mm'"]),
        ("depth_mm = 16.0", "", ["crack.depth_mm is missing"]),
        ("# material = ", "U = 30.0 # ", ["fluid", "viscosity_pa_s", "U"]),
        ("# material = ", "D_cm = 0.3\nwall_share = 0.5 # ", ["fluid: wall_share is 0.5 and D_cm is 0.3"]),
        ('freeze_after_s = "never"', "freeze_after_s = 0.0", ["fluid: freeze_after_s is 0.0", "never"]),
        ("mm_per_px = 0.1 ", "# mm_per_px = 0.1 ", ["photo", "no scale"]),
        ("mm_per_px = 0.1 ", "mm_per_px = 0.1\nface_mm = [160.0, 40.0] #", ["cannot be combined with face_mm"]),
        ('"crack.tilt",', '"crack.tillt",', ["assumed: crack.tillt", "crack.tilt"]),
        ("[nozzle]", "[sample]\ncrossfal_deg = 1\n[nozzle]", ["sample.crossfal_deg", "did you mean 'crossfall_deg'"]),
        ('# name = "S31"', 'name = "   " #', ["name = '   '", "not blank"]),
    ],
)
def test_the_error_for_a_faulty_trial_file_names_the_key(tmp_path, old, new, named):
    with pytest.raises(InputError) as fault:
        load_trial(_trial(tmp_path, (old, new)))
    for words in ["trial.toml", *named]:
        assert words in str(fault.value)


@pytest.mark.parametrize("key", [key for key in LAWS if key != "material"])
def test_setting_a_flow_law_removes_all_settings_of_other_laws(key):
    """The test includes every law of LAWS. U and D belong together."""
    every = {"D_cm", *LAWS, *(name for law in LAWS.values() for name in law.beside)}
    fluid = with_settings({"fluid": dict.fromkeys(every, 1)}, {f"fluid.{key}": 2})["fluid"]
    assert fluid.keys() == {key, "material", *LAWS[key].beside} | ({"D_cm"} if key == "U" else set())


def test_all_faults_of_a_trial_file_are_listed_together(tmp_path):
    wide = ("mm_per_px = 0.1 ", "face_mm = [160.0, 40.0] #"), ('diameter_mm = "auto"', "diameter_mm = 41.0")
    with pytest.raises(InputError, match=r"nozzle\.diameter_mm.*41"):
        load_trial(_trial(tmp_path, *wide))
    with pytest.raises(InputError) as fault:
        load_trial(_trial(tmp_path, ("depth_mm = 16.0", "depth_mm = 0.0"), ("speed_mm_s = 4.0", "speed = 4.0")))
    assert len(str(fault.value).splitlines()) == 2


def test_a_missing_file_a_device_and_a_folder_are_refused_as_trial_files(tmp_path):
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    for name, named in (("none.toml", "no such file"), ("zero.toml", "no such file"), ("", "a folder; give")):
        with pytest.raises(InputError, match=named):
            load_trial(tmp_path / name)


def test_a_valid_starter_trial_is_written_but_overwrites_no_file(tmp_path):
    """The paste has the values that a rheometer measures, and the readings name the sheet."""
    trial_file, sheet = write_starter(tmp_path / "new")
    trial = load_trial(trial_file)
    crack, fluid = present(trial.crack, "crack"), trial.given_fluid
    assert (crack.depth_mm, crack.tilt, trial.solver.radius_mm) == (16.0, "lean", "auto")
    assert (fluid.viscosity_pa_s, fluid.yield_stress_pa, fluid.U) == (0.3, 2.0, None)
    assert sheet.name in trial_file.read_text()
    trial_file.write_text("# mine\n")
    with pytest.raises(InputError, match="not overwritten"):
        write_starter(tmp_path / "new")
    assert trial_file.read_text() == "# mine\n"


def test_the_starter_prints_the_defaults_and_names_all_that_is_assumed(tmp_path):
    """The lines of the file are the defaults of the fields, so a trial without them is the same trial."""
    trial_file, _ = write_starter(tmp_path / "S31")
    trial = load_trial(trial_file)
    for table in ("crack", "path", "solver", "nozzle", "output"):
        home = getattr(trial, table)
        given = {"depth_mm": home.depth_mm} if table == "crack" else {}
        assert type(home)(**given) == home, table
    assert trial.name == "S31"
    begun = begin_trial(tmp_path / "crack.png", {"crack.depth_mm": 16.0, "photo.mm_per_px": 0.1})
    assert begun.assumptions == {**trial.assumptions, "photo.data": "undeclared"}
    assert {*begun.assumptions} == {*SEALANT, *UNMEASURED, "photo.data"}


OF_PASTE = {"fluid.viscosity_pa_s", "fluid.yield_stress_pa", "fluid.density_kg_m3"}


@pytest.mark.parametrize(
    ("settings", "left_out"),
    [
        ({"crack.tilt": "vertical"}, {"crack.tilt", "crack.wall_angle_deg"}),
        ({"path.volume_ml": 2.0, "fluid.U": 30.0}, {"path.fill", *OF_PASTE}),
        ({"fluid.U": 30.0, "fluid.yield_stress_pa": 4.0}, OF_PASTE - {"fluid.density_kg_m3"}),
        ({"fluid.material": "m.toml"}, OF_PASTE),
        ({"fluid.viscosity_pa_s": 2.0, "fluid.yield_stress_pa": 0.0}, OF_PASTE - {"fluid.density_kg_m3"}),
        ({"path.plan": "plan.csv"}, {"path.fill", "path.trim_mm", "path.speed_mm_s"}),
    ],
)
def test_what_is_given_or_excluded_is_not_assumed(tmp_path, settings, left_out):
    given = {"crack.depth_mm": 16.0, "photo.mm_per_px": 0.1, "photo.data": "measured"}
    trial = begin_trial(tmp_path / "crack.png", given | settings)
    assert {*trial.assumptions} == {*SEALANT, *UNMEASURED} - left_out
    changed = trial.changed({"nozzle.diameter_mm": 2.0}, tmp_path)
    assert {*changed.assumptions} == {*trial.assumptions} - {"nozzle.diameter_mm"}


def test_the_filled_starter_sheet_is_read_without_doubts(tmp_path):
    _, sheet = write_starter(tmp_path / "new")
    fixture = np.loadtxt(FIXTURE / "caliper.csv", delimiter=",", skiprows=1)[:, :4]
    book = openpyxl.load_workbook(sheet)
    for row, (s_mm, *levels_mm) in enumerate(fixture.tolist(), start=3):
        for column, value in enumerate([s_mm, *(-level_mm for level_mm in levels_mm)], start=1):
            book.worksheets[0].cell(row, column).value = value
    book.save(sheet)
    profile = read_readings(sheet, Declared(), depth_mm=16.0)
    assert not profile.doubts
    assert profile.s_mm.tolist() == fixture[:, 0].tolist()
    assert np.array_equal(present(profile.repeats_mm, "repeats"), fixture[:, 1:])


def test_a_resolved_trial_is_unchanged_after_writing_and_reading(tmp_path):
    trial = load_trial(FIXTURE / "trial.toml")
    path = tmp_path / "resolved.toml"
    path.write_text(trial_text(trial.content), encoding="utf-8")
    assert load_trial(path) == trial
    assert "\ndepth_mm = 16.0\n" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("fluid.u", "the most similar name is 'fluid.U'"),
        ("readings.file", "no such setting"),
        ("fluid.D_cm", "readings.fitted: fluid.D_cm is listed twice"),
    ],
)
def test_unknown_or_repeated_fitted_settings_are_refused(tmp_path, name, says):
    trial = Path(shutil.copy(FIXTURE / "trial.toml", tmp_path))
    edit(trial, '"fluid.U", ', f'"{name}", ')
    with pytest.raises(InputError, match=re.escape(says)):
        load_trial(trial)


@pytest.mark.parametrize(
    ("uncommented", "left_out"),
    [
        ("ends_px via_px roi_px", ""),
        ("ruler_px ruler_mm", "mm_per_px scale_is"),
        ("fill", ""),
        ("material", "viscosity_pa_s yield_stress_pa"),
    ],
)
def test_commented_lines_of_the_starter_are_valid_settings(tmp_path, uncommented, left_out):
    text = TRIAL
    for key in uncommented.split():
        text = re.sub(rf"(?m)^# ({key} )", r"\1", text)
    for key in left_out.split():
        text = re.sub(rf"(?m)^({key} )", r"# \1", text)
    (tmp_path / "trial.toml").write_text(text)
    trial = load_trial(tmp_path / "trial.toml")
    given = {**vars(present(trial.photo, "photo")), **vars(trial.crack), **vars(trial.given_fluid)}
    assert all(given[key] for key in uncommented.split())


@pytest.mark.parametrize(
    ("tables", "named"),
    [
        ('[mesh]\nfile = "a.stl"\ndata = "measured"\nunits = "mm"\n[crack]\ndepth_mm = 16\n', "cannot be combined"),
        ("", "[photo], [mesh], [drawing]"),
        ('[photo]\nfile = "a.png"\ndata = "measured"\nmm_per_px = 0.1\n', "[crack] is missing"),
    ],
)
def test_a_trial_needs_either_a_mesh_or_a_photo_with_a_crack(tmp_path, tables, named):
    path = tmp_path / "trial.toml"
    path.write_text(f'name = "a"\n{tables}')
    with pytest.raises(InputError, match=re.escape(named)):
        load_trial(path)


@pytest.mark.parametrize(
    ("name", "folder"),
    [("A <b>crack</b> $x$", "A--b-crack--b---x"), ("../..", "trial"), ("\U0001d49c" * 80, "\U0001d49c" * 30)],
)
def test_a_trial_name_becomes_a_safe_folder_name(tmp_path, name, folder):
    trial = load_trial(_trial(tmp_path, ('# name = "S31"', f'name = "{name}" #')))
    assert trial.name == name
    assert trial.folder_name == folder


def poured(width_mm: float = 3.1) -> Sample:
    crack = slot(20.0, width_mm)
    return sample_of(crack, path(crack[1], 0.3))


def trial_of(fluid: dict[str, Any], **solver: Any) -> Trial:
    mesh = {"file": Path("crack.stl"), "data": "synthetic", "units": "mm"}
    fluid = {"freeze_after_s": "never", **fluid}
    return Trial.model_validate({"name": "tiny", "mesh": mesh, "fluid": fluid, "solver": solver})


@pytest.mark.parametrize(
    "fluid",
    [{"U": 30.0, "D_cm": 0.3, "yield_stress_pa": 12.0}, {"viscosity_pa_s": 0.3}, {"viscosity_pa_s": 2.0, "D_cm": 0.1}],
)
def test_a_draft_has_the_viscosity_and_the_drag_of_the_trial(fluid):
    sample, trial = poured(), trial_of(fluid, radius_mm=0.4)
    draft = drafted(trial, sample)
    assert draft.solver.preset == "draft"
    assert draft.solver.size_mm == pytest.approx(3.1 / 5.2, rel=2e-3)
    flows = []
    for each in (trial, draft):
        radius_mm = each.solver.size_mm
        frame_s = plan_releases(sample.trajectory, radius_mm, each.nozzle.over(3.1).size_mm, each.seed).frame_s
        weights = rheology_of(each.given_fluid, 0.4 * radius_mm, frame_s)
        flows.append((weights.viscosity_pa_s, weights.yield_cm2_s2, weights.wall_weight_cm / frame_s))
    assert flows[0] == pytest.approx(flows[1], rel=1e-6)
    crack = sample.solid, sample.outline
    run = injected(crack, sample.trajectory, trial.given_fluid, preset="draft", radius_mm=0.4, settle_s=2.0)
    assert run.pour.solver == draft.solver
    assert run.pastes[0].viscosity_pa_s == pytest.approx(flows[0][0])
    others = {"fluid", "solver", "nozzle"}
    assert draft.model_dump(exclude=others) == trial.model_dump(exclude=others)


@pytest.mark.parametrize(("radius_mm", "width_mm", "draft_mm"), [(0.7, 3.1, 0.7), (0.4, 9.0, 1.2)])
def test_the_particle_radius_of_a_draft_is_bounded_by_trial_and_nozzle(radius_mm, width_mm, draft_mm):
    trial = trial_of({"viscosity_pa_s": 0.3}, radius_mm=radius_mm)
    assert drafted(trial, poured(width_mm)).solver.size_mm == draft_mm


def test_a_calibrated_material_is_refused_at_another_particle_radius():
    material = Material.model_validate({
        "method": "calibration", "date": "2026-11-01", "data": "measured", "not_for": ["flow"], "radius_mm": 0.5,
        "yield_stress_pa": 12.0, "yield_stress_error_pa": 1.0, "yield_stress_95_pa": (10.0, 14.0),
        "viscosity_pa_s": 0.3, "viscosity_error_percent": 10.0, "density_kg_m3": 1690.0, "density_error_kg_m3": 0.0,
    })  # fmt: skip
    trial = trial_of({"viscosity_pa_s": 0.3}, radius_mm=0.5)
    fluid = trial.given_fluid.model_copy(update={"material": material})
    assert drafted(trial.model_copy(update={"fluid": fluid}), poured()).solver.size_mm == 0.5
    with pytest.raises(InputError, match=r"solver.radius_mm is 0.4.*calibrated at 0.5"):
        check_fit(poured().outline, poured().solid, fluid, Solver(radius_mm=0.4), Nozzle(diameter_mm=2.4), trial.sample)
