"""Run folders: finished stages, edited files, and files of the user that must stay untouched."""

import re
import subprocess
import sys

import pytest

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.run_folder import HOLDER, LOCK, MANIFEST, holding, open_folder, stage_key

NUMBERS = {"digitise": 1}
KEY = stage_key({"photo.jpg": "1"}, {"depth_mm": 16.0}, NUMBERS)


def _finish(folder, stage="digitise", name="outline.json", inputs=None, given=("photo.jpg",)):
    files.write_text(folder.path / name, "{}")
    facts = {"numbers": NUMBERS, "from_user": given}
    folder.record(stage, KEY, {"depth_mm": 16.0}, inputs or {"photo.jpg": "1"}, [name], 1.0, **facts)


def test_a_stage_is_current_until_its_key_or_its_files_change(tmp_path):
    with open_folder(tmp_path / "run", create=True) as folder:
        assert not folder.is_current("digitise", KEY)
        _finish(folder)
    with open_folder(tmp_path / "run", create=True) as folder:
        assert folder.is_current("digitise", KEY)
        for photo, depth_mm, numbers in (
            ("2", 16.0, NUMBERS), ("1", 16.5, NUMBERS), ("1", 16.0, {"digitise": 2}), ("1", 16.0, {"simulate": 1})
        ):  # fmt: skip
            assert not folder.is_current("digitise", stage_key({"photo.jpg": photo}, {"depth_mm": depth_mm}, numbers))
        (folder.path / "outline.json").write_text("{ }")
        assert not folder.is_current("digitise", KEY)


def test_clearing_a_stage_renames_edited_files_and_deletes_other_files(tmp_path):
    with open_folder(tmp_path / "run", create=True) as folder:
        for text, kept_as in (("mine", "outline.changed.json"), ("mine again", "outline.changed2.json")):
            _finish(folder)
            assert folder.edited("digitise") == []
            (folder.path / "outline.json").write_text(text)
            assert folder.edited("digitise") == ["outline.json"]
            assert folder.clear("digitise") == [kept_as]
            assert folder.settings_of("digitise") is None
        assert (folder.path / "outline.changed.json").read_text() == "mine"
        _finish(folder, name="below/outline.json")
        assert folder.clear("digitise") == []
        assert not (folder.path / "below" / "outline.json").exists()


def test_a_stage_is_finished_only_if_its_inputs_are_unchanged(tmp_path):
    with open_folder(tmp_path / "run", create=True) as folder:
        _finish(folder)
        digest = files.sha256(folder.path / "outline.json")
        _finish(folder, "simulate", "particles.csv", {"outline.json": digest}, given=())
        assert folder.finished() == ["digitise", "simulate"]
        files.write_text(folder.path / "outline.json", "{ }")
        assert folder.finished() == ["digitise"]
        files.write_text(folder.path / "outline.json", "{}")
        folder.manifest["stages"]["digitise"] = folder.manifest["stages"].pop("digitise")
        assert folder.finished() == ["digitise", "simulate"]
        (folder.path / "particles.csv").unlink()
        assert folder.finished() == ["digitise"]


@pytest.mark.parametrize("name", [".crack.12345.stl", "sealtwin-tmp-1-00000000"])
def test_a_hidden_file_of_the_user_is_not_removed(tmp_path, name):
    """A name with a dot, a number and a suffix was once taken for a temporary file of a killed run."""
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match=re.escape(name)), open_folder(tmp_path, create=True):
        pass
    with open_folder(tmp_path / "run", create=True) as folder:
        (folder.path / name).write_text("mine")
    with open_folder(tmp_path / "run", create=True):
        pass
    assert [path.read_text() for path in (tmp_path / name, tmp_path / "run" / name)] == ["mine", "mine"]


def test_a_run_killed_at_its_first_file_can_be_started_again(tmp_path):
    """The folder then contains a temporary file and no manifest."""
    script = (
        "import os, sys; from pathlib import Path; from sealtwin.core.files import replacing\n"
        "with replacing(Path(sys.argv[1])) as temporary:\n"
        "    temporary.write_text('half'); os._exit(9)"
    )
    killed = subprocess.run([sys.executable, "-c", script, str(tmp_path / "run" / "crack.stl")], check=False)
    assert killed.returncode == 9
    assert len(list((tmp_path / "run").iterdir())) == 1
    with open_folder(tmp_path / "run", create=True) as folder:
        assert {path.name for path in folder.path.iterdir()} == {MANIFEST, HOLDER, LOCK}


def test_unfinished_files_are_removed_from_all_folders_but_from_run_folders_with_a_lock_of_their_own(tmp_path):
    lab, name = tmp_path / "lab", ".sealtwin-tmp-4711-0123abcd.csv"
    with open_folder(lab / "P1" / "run", create=True):
        pass
    for folder in (lab, lab / "P1" / "inputs", lab / "P1" / "run" / "figures"):
        folder.mkdir(exist_ok=True)
        (folder / name).touch()
    with holding(lab):
        assert [*lab.rglob(name)] == [lab / "P1" / "run" / "figures" / name]
    with open_folder(lab / "P1" / "run", create=False):
        assert not [*lab.rglob(name)]


def test_a_path_that_is_not_a_run_folder_is_refused(tmp_path):
    """The paths: another folder, a file, a folder below a file, a missing folder, and a name that is not UTF-8."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "trial.toml").write_text("mine")
    for path, fault, create in (
        (tmp_path / "mine", r"trial\.toml", True),
        (tmp_path / "mine" / "trial.toml", "is a file, but", True),
        (tmp_path / "mine" / "trial.toml" / "below", "is a file, but", True),
        (tmp_path / "none", "not a run folder", False),
        (tmp_path / "caf\udce9", r"caf\\xe9: the name is not UTF-8", True),
    ):
        with pytest.raises(InputError, match=fault), open_folder(path, create=create):
            pass
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
    assert (tmp_path / "mine" / "trial.toml").read_text() == "mine"


@pytest.mark.parametrize(
    "content",
    [
        '{"version": 1, "stages": {"digitise": {}}}',
        '{"version": 1, "stages": {"digitise": {"key": "", "settings": [], "inputs": {}, "given": [], "outputs": {}, '
        '"wall_time_s": 1, "versions": {}}}}',
    ],
)
def test_a_manifest_with_missing_or_wrong_fields_is_refused(tmp_path, content):
    with open_folder(tmp_path / "run", create=True):
        pass
    (tmp_path / "run" / MANIFEST).write_text(content)
    with pytest.raises(InputError, match=r"manifest\.json"), open_folder(tmp_path / "run", create=True):
        pass


@pytest.mark.parametrize(
    ("name", "cause"),
    [
        ("{home}/mine.txt", "manifest.json: is damaged"),
        ("a/../../mine.txt", "manifest.json: is damaged"),
        ("link/mine.txt", "link: is a link to a folder elsewhere"),
        ("..", "manifest.json: is damaged"),
    ],
)
def test_a_manifest_with_paths_outside_its_folder_is_refused(tmp_path, name, cause):
    """A repeated stage moves or removes the files that the manifest lists as its outputs."""
    mine = tmp_path / "mine.txt"
    mine.write_text("mine")
    with open_folder(tmp_path / "run", create=True) as folder:
        _finish(folder)
        if name.startswith("link"):
            (folder.path / "link").symlink_to(tmp_path)
        folder.manifest["stages"]["digitise"]["outputs"] = {name.format(home=tmp_path): "0" * 64}
        folder.save()
    with pytest.raises(InputError, match=cause), open_folder(tmp_path / "run", create=True) as folder:
        folder.clear("digitise")
    assert mine.read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine.txt", "run"]


def test_a_link_to_a_folder_outside_the_run_is_refused(tmp_path):
    """Writing through such a link would replace files outside. A link to a folder inside is accepted."""
    for folder in ("run/inside", "elsewhere"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "run" / "frames").symlink_to("inside")
    (tmp_path / "run" / MANIFEST).write_text('{"version": 1, "stages": {}}')
    with open_folder(tmp_path / "run", create=True):
        pass
    (tmp_path / "run" / "inputs").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="inputs: is a link"), open_folder(tmp_path / "run", create=True):
        pass
