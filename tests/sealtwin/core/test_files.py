"""Files of a run folder: written completely or not at all, unchanged after reading, refused if damaged."""

import csv
import errno
import io
import json
import os
import re
from functools import reduce
from operator import getitem

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_equal

from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core import files, record_files
from sealtwin.core.errors import InputError
from sealtwin.core.files import read_json, read_table, sha256, sheet_text, write_table
from sealtwin.core.plain_files import opened, read_bytes, read_text
from sealtwin.core.records import Profile, Run, Trajectory
from sealtwin.core.run_figures import RunHealth
from tests.support.shapes import straight_slot


@pytest.mark.parametrize("fault", [RuntimeError("crack.stl"), OSError(errno.ENOSPC, "No space left on device")])
def test_a_failed_write_leaves_the_old_file_and_no_temporary_file(tmp_path, fault):
    """The error of a full disk names the file that was written."""
    path = tmp_path / "crack.stl"
    files.write_text(path, "old")
    with pytest.raises(type(fault), match=r"crack\.stl"), files.replacing(path) as temporary:  # noqa: PT012
        temporary.write_text("half of the n")
        raise fault
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("crack.stl", "old")]


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("s_mm\n1\n", "level_mm"),
        ("s_mm,level_mm\n1,two\n", "row 0"),
        ("s_mm,level_mm\n1\n", "row [01]"),
        # A field that never ends.
        ('"' + "x" * 200_000, "line 1|CSV"),
    ],
)
def test_the_error_for_a_damaged_table_names_the_file_and_the_position(tmp_path, text, named):
    path = tmp_path / "profile.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=rf"profile\.csv.*({named})") as fault:
        read_table(path, ("s_mm", "level_mm"))
    assert len(str(fault.value)) < 400


def test_nan_and_infinity_are_written_as_null_in_json():
    content = {"a": np.float64("nan"), "b": np.array([1.0, np.inf]), "c": np.int64(3), "d": (True, np.bool_(False))}
    assert json.loads(files.as_json(content)) == {"a": None, "b": [1.0, None], "c": 3, "d": [True, False]}


def test_a_trajectory_and_a_profile_are_unchanged_after_writing_and_reading(tmp_path):
    columns = dict(zip(("t_s", "s_mm", "speed_mm_s", "flow_mm3_s"), np.arange(8.0).reshape(4, 2) + 0.25, strict=True))
    trajectory = Trajectory(position_mm=np.array([[1.0, 2.0, 3.0], [2.0, 2.0, 3.0]]), **columns)
    record_files.write_trajectory(tmp_path, trajectory)
    assert_equal(vars(record_files.read_trajectory(tmp_path)), vars(trajectory))
    assert (tmp_path / "trajectory.txt").read_text().splitlines()[1] == "2.0000 2.0000 3.0000"
    profile = Profile(s_mm=np.array([0.0, 1.0]), level_mm=np.array([-16.0, 0.5]))
    record_files.write_profile(tmp_path, profile)
    assert_equal(record_files.read_profile(tmp_path).level_mm, profile.level_mm)


def written_run(folder, count=1):
    """A run of particles at random places; the second is spilled, and no density was measured."""
    chance = np.random.default_rng(0)
    run = Run(
        position_mm=chance.normal(size=(count, 3)),
        velocity_mm_s=chance.normal(size=(count, 3)),
        age_s=chance.uniform(size=count),
        spilled=np.arange(count) == 1,
        radius_mm=0.4,
        particle_volume_mm3=0.33,
        escaped_particles=0,
        device="cpu",
        settings={"solver": {"substeps": 4, "preset": "accurate"}, "seed": 0},
        health=RunHealth(frames=3, volume_ratio=1.0, density_error_mean=np.nan),
    )
    record_files.write_run(folder, run)
    return run


def test_a_run_is_unchanged_after_writing_and_reading(tmp_path):
    """Figures without a number and the order of settings are unchanged too."""
    run = written_run(tmp_path, 5)
    again = record_files.read_run(tmp_path)
    assert_allclose(again.position_mm, run.position_mm, atol=1e-6)
    assert again.spilled_particles == 1
    assert again.dispensed_volume_mm3 == pytest.approx(5 * 0.33)
    assert again.health == run.health
    assert again.health.density_error_mean is None
    assert json.dumps(again.settings) == json.dumps(run.settings)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("particles", 2),
        ("radius_mm", float("nan")),
        ("health", {"volume_ratio": "all of it"}),
    ],
)
def test_the_error_for_a_run_with_an_invalid_field_names_the_field(tmp_path, key, value):
    """Seen to fail without a check: a report was made from "particles": "many"."""
    written_run(tmp_path)
    path = tmp_path / "simulation.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))
    with pytest.raises(InputError, match=rf"^[^\n]*simulation\.json( has {value}|.*{key})[^\n]*again\.$"):
        record_files.read_run(tmp_path)


@pytest.mark.parametrize(
    ("name", "row", "fault"),
    [
        ("profile.csv", "1.0,nan", "line 3: level_mm = nan; expected a number"),
        ("profile.csv", "0.0,1.0", "s_mm increasing from row to row. Simulate"),
        ("particles.csv", "0,0,nan,0,0,0,0,0", "line 3: z_mm = nan; expected a number"),
        ("particles.csv", "0,0,0,0,0,0,0,0", "has 2 particles, 0 of them spilled, but simulation.json has 1 and 0"),
    ],
)
def test_an_impossible_row_of_a_result_file_is_refused(tmp_path, name, row, fault):
    """A particle that fell out of its sample for twenty seconds, two kilometres in the paper's trial, is still read."""
    written_run(tmp_path)
    write_table(tmp_path / "particles.csv", record_files.PARTICLE_COLUMNS, np.array([[0, 0, -2e6, 0, 0, -2e5, 20, 0]]))
    assert record_files.read_run(tmp_path).position_mm[0, 2] == -2e6
    record_files.write_profile(tmp_path, Profile(np.array([0.0]), np.array([-1.0])))
    with (tmp_path / name).open("a") as table:
        table.write(row + "\n")
    with pytest.raises(InputError, match=rf"{name}.*{fault}.*again|{fault}"):
        (record_files.read_profile if name == "profile.csv" else record_files.read_run)(tmp_path)


@pytest.mark.parametrize("start", ["=", "@", "\t", "\r", "\uff1d"])
def test_spreadsheet_formulas_in_exported_tables_are_written_as_text(start):
    """A note such as =HYPERLINK(...) would run in a spreadsheet. Numbers, also negative, stay numbers."""
    written = f"{start}cmd|' /C calc'!A0"
    text = sheet_text(["note", "level_mm", "runs"], [[written, -1.5, 12_345_678], ["a\r=1", 0.1, 1]])
    _, (note, level_mm, runs), (second, *_) = csv.reader(io.StringIO(text, newline=""))
    assert note == "'" + written.replace("\r", "\n")
    assert second == "a\n=1", "no row may begin within a cell"
    assert (float(level_mm), runs) == (-1.5, "12345678")


@pytest.mark.parametrize(
    ("file", "keys", "value", "fault"),
    [
        ("solid.json", ("face_label",), "012", "face_label has 3 labels"),
        ("outline.json", ("mm_per_px",), "0.1", "mm_per_px = '0.1'"),
        ("outline.json", ("left_wall_mm",), [[1, 2, 3]], "left_wall_mm = [[1, 2, 3]]"),
        ("solid.json", ("sections", "s_mm"), [0, None], "sections.s_mm = [0, None]"),
        ("outline.json", ("branches_mm",), [[[1, "deep"]]], "branches_mm.0 = [[1, 'deep']]"),
    ],
)
def test_the_error_for_an_invalid_edited_value_names_the_file_and_the_key(tmp_path, file, keys, value, fault):
    outline = straight_slot()
    record_files.write_outline(tmp_path, outline)
    record_files.write_solid(tmp_path, build_solid(outline, CrackShape(depth_mm=8.0)))
    content = json.loads((tmp_path / file).read_text())
    reduce(getitem, keys[:-1], content)[keys[-1]] = value
    (tmp_path / file).write_text(json.dumps(content))
    read = record_files.read_outline if file == "outline.json" else record_files.read_solid
    with pytest.raises(InputError, match=rf"^{tmp_path / file}.*{re.escape(fault)}.*again"):
        read(tmp_path)


NO_FILES = {
    "a pipe, which waits for ever": (os.mkfifo, "a device or a pipe"),
    "a folder": (os.mkdir, "a folder"),
    "an endless sparse file": (lambda path: (path.touch(), os.truncate(path, 10**12)), "larger than"),
}


@pytest.mark.parametrize(("make", "words"), NO_FILES.values(), ids=NO_FILES)
def test_a_pipe_a_folder_and_an_oversized_file_are_refused_without_being_read(tmp_path, make, words):
    """Each reader would fill the memory or wait without end; ``opened`` reads in pieces."""
    path = tmp_path / "report.json"
    make(path)
    for read in (read_bytes, read_text, read_json, sha256):
        with pytest.raises(InputError, match=rf"report\.json: .*{words}"):
            read(path)
    with pytest.raises(InputError, match=words), opened(path):
        pass
