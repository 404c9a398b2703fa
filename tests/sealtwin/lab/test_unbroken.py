"""An ingest that is stopped, killed, doubled or struck by a fault leaves a lab that is whole."""

import random
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.core.run_folder import holding
from sealtwin.lab import ingest as steps
from sealtwin.lab.catalogue import Catalogue
from sealtwin.lab.ingest import ingest
from tests.support.ingested_lab import QUIET, fates, hashes_of, rows_of
from tests.support.lab_folder import HANDS
from tests.support.messages import Narration


def _trials(lab):
    return sum(1 for _ in lab.glob("[!.]*/record.json"))


@pytest.mark.parametrize("step", [(steps, "keep"), (Catalogue, "save"), (steps.files, "write_if_new")])
def test_stopped_at_any_step_the_same_command_completes_the_lab(small, two, tmp_path, monkeypatch, step):
    lab = tmp_path / "lab"

    def stop(*_, **__):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(*step, stop)
        with pytest.raises(KeyboardInterrupt):
            ingest(small, lab, QUIET)
    assert not ingest(small, lab, QUIET).faults
    unbroken = two / "lab"
    assert rows_of(lab) == rows_of(unbroken)
    assert sorted(path.name for path in lab.iterdir()) == sorted(path.name for path in unbroken.iterdir())


def test_a_hidden_folder_of_the_users_in_a_lab_is_never_removed(small, tmp_path):
    mine = tmp_path / "lab" / ".incoming" / "photo.jpg"
    mine.parent.mkdir(parents=True)
    mine.write_text("mine")
    assert not ingest(small, tmp_path / "lab", QUIET).faults
    assert mine.read_text() == "mine"


def test_of_two_ingests_at_once_one_waits_for_the_other(small, tmp_path):
    lab, narration = tmp_path / "lab", Narration()
    with ThreadPoolExecutor() as other:
        with holding(lab):
            waiting = other.submit(ingest, small, lab, narration)
            while not narration.notes and not waiting.done():
                time.sleep(0.01)
            assert "waiting for it" in narration.notes[0]
            assert _trials(lab) == 0
        assert not waiting.result().faults
    assert _trials(lab) == 2


@pytest.mark.slow
def test_killed_again_and_again_an_ingest_loses_nothing(sound, tmp_path):
    """SIGKILL at random moments after one more trial is there, then once to its end: the same as unbroken."""
    chance = random.Random(5)
    lab = tmp_path / "lab"
    kept = [0]
    while kept[-1] < len(HANDS) - 1 and len(kept) < 12:
        process = subprocess.Popen(
            [sys.executable, "-m", "sealtwin", "ingest", sound[0], "--out", lab, "--quiet"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        while process.poll() is None and _trials(lab) == kept[-1]:
            time.sleep(0.002)
        # About what a trial takes.
        time.sleep(chance.uniform(0, 0.015))
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert _trials(lab) > kept[-1]
        kept.append(_trials(lab))
    assert len(kept) > 3
    ingested = ingest(sound[0], lab, QUIET)
    assert not ingested.faults
    assert rows_of(lab) == rows_of(sound[2])
    for sample in HANDS:
        names = ("trial.toml", "inputs")
        hashes, unbroken = (
            {name: digest for name, digest in hashes_of(place / sample).items() if name.startswith(names)}
            for place in (lab, sound[2])
        )
        assert hashes == unbroken


def test_a_bug_that_one_sample_wakes_costs_no_other_one(small, tmp_path, monkeypatch):
    real = steps.prepare

    def burst(prepared):
        if prepared.name == "P01":
            raise ZeroDivisionError("on purpose")
        real(prepared)

    monkeypatch.setattr(steps, "prepare", burst)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert fates(ingested) == {"P01": "bug", "P02": "new"}
    assert "P01.png: ZeroDivisionError: on purpose" in next(iter(ingested.samples[0].questions))
    assert ingest_answer(ingested).exit_code == 1


def test_a_file_that_cannot_be_read_is_its_samples_fault_and_a_full_disk_is_nobodys(small, tmp_path, monkeypatch):
    real, lab = steps.gather, tmp_path / "lab"

    def failing(at):
        def gather(sample, *notes):
            if sample.name == "P01":
                raise OSError(28, "on purpose", str(at))
            return real(sample, *notes)

        monkeypatch.setattr(steps, "gather", gather)

    failing(small / "P01.png")
    outcomes = ingest(small, lab, QUIET).samples
    assert [*outcomes[0].questions] == ["P01.png: on purpose. Make it readable."]
    assert outcomes[1].fate == "new"
    failing(lab / "P01")
    with pytest.raises(OSError, match="on purpose"):
        ingest(small, lab, QUIET)


def test_a_file_that_changes_while_it_is_taken_in_is_not_kept(small, tmp_path, monkeypatch):
    real = steps.keep

    def changing(*arguments):
        (small / "P01.csv").write_text("s_mm,level_1_mm\n1,-1\n2,-1\n")
        return real(*arguments)

    monkeypatch.setattr(steps, "keep", changing)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert "P01.csv changed during the ingest" in next(iter(ingested.samples[0].questions))
    assert "p01" in Catalogue.of(tmp_path / "lab").faults(), "nor is it run"
