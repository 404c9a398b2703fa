"""'sealtwin export' and 'sealtwin import-dxf': out to CAD, and back as the same crack."""

import json
import shutil

import pytest

from tests.support.processes import refusal, sealtwin
from tests.support.tiny_study import TRIAL, tiny_lab


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A digitised run of a crack of 50 mm."""
    lab = tmp_path_factory.mktemp("lab")
    tiny_lab(lab)
    (lab / "trial.toml").write_text(TRIAL.replace("mm_per_px = 0.1", "mm_per_px = 0.4"))
    assert sealtwin("digitise", lab / "trial.toml", "--out", lab / "run").exit_code == 0
    return lab / "run"


def test_out_to_cad_and_back_it_is_the_same_crack(run, tmp_path):
    written = sealtwin("export", run, "--format", "mask,coco,dxf", "--out", tmp_path / "out", "--json")
    assert written.exit_code == 0, written.output
    names = sorted(file.name for file in (tmp_path / "out").iterdir())
    assert names == ["coco.json", "crack.dxf", "crack_mask.png"]
    assert len(json.loads((tmp_path / "out" / "coco.json").read_text())["annotations"]) == 1
    before = json.loads((run / "run.json").read_text())["sample"]
    for number, how in enumerate(((), ("--walls", "WALL_LEFT", "WALL_RIGHT"))):
        folder = tmp_path / f"drawn{number}"
        drawn = sealtwin("import-dxf", tmp_path / "out" / "crack.dxf", "--depth-mm", 8, *how, "--out", folder, "--json")
        assert drawn.exit_code == 0, drawn.output
        after = json.loads(drawn.stdout)["sample"]
        assert after["length_mm"] == pytest.approx(before["length_mm"], rel=0.03)
        assert after["mean_width_mm"] == pytest.approx(before["mean_width_mm"], rel=0.05)
        assert (folder / "trial.toml").is_file()


def test_runs_of_one_name_what_is_no_run_and_a_file_of_the_users_are_named(run, tmp_path):
    twin, mine = shutil.copytree(run, tmp_path / "twin"), tmp_path / "mine"
    mine.mkdir()
    (mine / "coco.json").write_text("mine")
    for runs, out, named in (
        ((run, twin), "out", "several runs"),
        ((tmp_path,), "out", "not a run folder"),
        ((run,), "mine", "coco.json: already exists"),
    ):
        assert named in refusal("export", *runs, "--format", "mask,coco", "--out", tmp_path / out)
    assert not (tmp_path / "out").exists()
    assert [(file.name, file.read_text()) for file in mine.iterdir()] == [("coco.json", "mine")]


def test_samples_whose_photos_have_one_name_have_that_of_their_trials(run, tmp_path):
    shutil.copytree(run, tmp_path / "twin")
    trial = tmp_path / "twin" / "trial.toml"
    trial.write_text(trial.read_text().replace('name = "', 'name = "other-', 1))
    answer = sealtwin("export", run, tmp_path / "twin", "--format", "mask,coco", "--out", tmp_path / "out")
    assert answer.exit_code == 0, answer.output
    images = json.loads((tmp_path / "out" / "coco.json").read_text())["images"]
    assert len({image["file_name"] for image in images}) == 2
    assert len(list((tmp_path / "out").glob("other-*_mask.png"))) == 1


@pytest.mark.parametrize("options", ["--line L", "--outline A --walls B C", "--depth-mm 1e9"])
def test_options_that_do_not_go_together_are_a_usage_error(tmp_path, options):
    (tmp_path / "a.dxf").write_text("")
    answer = sealtwin("import-dxf", tmp_path / "a.dxf", "--depth-mm", 8, "--out", tmp_path / "out", *options.split())
    assert answer.exit_code == 2


@pytest.mark.parametrize(("name", "content"), [("a.dxf", b"\x00\xff" * 50), ("a.dwg", b"AC1032"), ("b", None)])
def test_what_is_no_drawing_is_one_sentence(tmp_path, name, content):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert name in refusal("import-dxf", tmp_path / name, "--depth-mm", 8, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()
