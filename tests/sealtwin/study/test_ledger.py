"""The ledger: a run belongs to one process at a time, and what is done stays done."""

import sqlite3
from concurrent.futures import ThreadPoolExecutor

import pytest

from sealtwin.errors import InputError
from sealtwin.study.ledger import LEDGER, Entry, Ledger, read_study


def _entry(number, kin="a"):
    return Entry(f"key{number:02}", number, {"fluid.U": float(number)}, "{}", "sample", kin, 1.0)


@pytest.fixture
def ledger(tmp_path):
    with Ledger(tmp_path, create=True) as opened:
        opened.plan([_entry(number) for number in (1, 2, 3)])
        yield opened


def test_each_run_is_claimed_once_however_many_ask(tmp_path):
    """Forty runs, eight threads with connections of their own: each key comes out once."""
    with Ledger(tmp_path, create=True) as ledger:
        ledger.plan([_entry(number) for number in range(1, 41)])

    def take(_):
        taken = []
        with Ledger(tmp_path) as own:
            while (claim := own.claim()) is not None:
                taken += [entry.key for entry in claim.entries]
        return taken

    with ThreadPoolExecutor(8) as pool:
        taken = [key for keys in pool.map(take, range(8)) for key in keys]
    assert sorted(taken) == [f"key{number:02}" for number in range(1, 41)]


def test_runs_are_handed_out_in_the_order_of_the_study_and_in_one_launch_only_with_their_kin(tmp_path):
    with Ledger(tmp_path, create=True) as ledger:
        ledger.plan([_entry(1, "a"), _entry(2, "b"), _entry(3, "a"), _entry(4, "a")])
        claims = [ledger.claim(2), ledger.claim(2), ledger.claim(2), ledger.claim(2)]
    numbers = [[entry.number for entry in claim.entries] if claim else None for claim in claims]
    assert numbers == [[1, 3], [2], [4], None]


def test_who_lost_a_run_can_neither_finish_nor_fail_it(ledger):
    late = ledger.claim()
    ledger.put_back([late.entries[0].key])
    again = ledger.claim()
    assert again.entries == late.entries
    assert not ledger.finish(late, "key01", 1.0, {"mean_error_mm": 9.0})
    assert not ledger.fail(late, "key01", 1.0, "late")
    assert ledger.finish(again, "key01", 2.0, {"mean_error_mm": 1.0})
    assert not ledger.finish(again, "key01", 3.0, {"mean_error_mm": 5.0})
    (run, *_) = ledger.runs()
    assert (run.state, run.wall_s, run.figures, run.tries) == ("done", 2.0, {"mean_error_mm": 1.0}, 2)


def test_planning_again_keeps_what_is_done_and_frees_what_nobody_finished(ledger):
    done, lost = ledger.claim(), ledger.claim()
    ledger.finish(done, "key01", 1.0, {"volume_ratio": 1.0})
    # The study lost its third run, and has a new one in front.
    ledger.plan([_entry(4), Entry("key01", 2, {"fluid.U": 1.0}, "{}", "sample", "a", 1.0), _entry(2)])
    assert [(run.key, run.state) for run in ledger.runs()] == [
        ("key01", "done"),
        ("key02", "waiting"),
        ("key04", "waiting"),
    ]
    assert not ledger.finish(lost, "key02", 1.0, {})
    assert ledger.count("waiting") == 2


def test_a_number_that_is_none_is_no_figure(ledger):
    claim = ledger.claim()
    with pytest.raises(ValueError, match="JSON"):
        ledger.finish(claim, "key01", 1.0, {"mean_error_mm": float("nan")})
    assert ledger.runs()[0].figures is None


def test_progress_counts_the_frames_of_a_run_that_is_under_way(ledger):
    ledger.finish(ledger.claim(), "key01", 1.0, {})
    ledger.beat(ledger.claim(), 25, 100)
    assert ledger.progress_s() == pytest.approx(1.25)


def test_another_process_reads_while_one_writes(ledger, tmp_path):
    """WAL: a reader neither waits nor sees half a change."""
    ledger.claim()
    writer = sqlite3.connect(tmp_path / LEDGER, isolation_level=None)
    writer.execute("BEGIN EXCLUSIVE")
    writer.execute("UPDATE runs SET state = 'done'")
    assert [run.state for run in read_study(tmp_path)] == ["running", "waiting", "waiting"]
    writer.execute("ROLLBACK")
    writer.close()


def test_a_folder_without_a_study_and_a_damaged_ledger_are_told(tmp_path):
    with pytest.raises(InputError, match="no study"):
        read_study(tmp_path)
    (tmp_path / LEDGER).write_text("This is no database, whatever its name says." * 40)
    with pytest.raises(InputError, match="no ledger that can be read"):
        read_study(tmp_path)
