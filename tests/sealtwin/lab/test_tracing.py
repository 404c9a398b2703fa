"""After an ingest all sound samples are traced, once, into the folders that their runs go on in."""

import json

import pytest

from tests.support.ingested_lab import sealtwin
from tests.support.photos import mortar, write_png


@pytest.fixture
def traced(small, tmp_path):
    """P01 has a crack; P02's photo shows none; a reading of P01 lies beyond its crack's end."""
    write_png(small / "P02.png", mortar((200, 200), seed=3))
    (small / "P02_Notiz.toml").write_text("crack.depth_mm = 8.0\n")
    with (small / "P01.csv").open("a") as sheet:
        sheet.write("40.0,-1.0,-1.0,-1.0\n")
    return small, tmp_path / "lab"


def _ingest(small, lab, *more):
    return sealtwin("ingest", small, "--out", lab, "--quiet", *more)


def test_walls_are_there_after_an_ingest_and_a_fault_costs_no_other(traced):
    """And a run goes on where tracing ended."""
    small, lab = traced
    answer = _ingest(small, lab, "--json")
    assert answer.exit_code == 6
    content = json.loads(answer.stdout)
    assert [sample["state"] for sample in content["samples"]] == ["new", "new"]
    photos = {photo["folder"]: photo["status"] for photo in content["traced"]["photos"]}
    assert photos == {"P01/run": "ok", "P02/run": "failed"}
    assert "P01/run/overlay.png" in (lab / "index.html").read_text()
    outside, unseen = content["faults"]
    assert unseen["name"] == "P02"
    assert "P01.csv: 40 mm in A8 is outside the crack, 0 to 1" in outside["sentence"]
    traces = [lab / "P01" / "run" / name for name in ("overlay.png", "outline.json")]
    before = [path.stat().st_mtime_ns for path in traces]
    again = _ingest(small, lab)
    assert again.stdout.count("unchanged, not sound") == 2
    assert "sealtwin run" not in again.stdout, "none of them would run"
    run = sealtwin("digitise", lab / "P01" / "trial.toml", "--out", lab / "P01" / "run", "--quiet")
    assert run.exit_code == 0, run.output
    assert [path.stat().st_mtime_ns for path in traces] == before
    listed = sealtwin("lab", "list", lab).stdout
    assert listed.count("not sound") == 2
    assert "failed: P01: " in listed
