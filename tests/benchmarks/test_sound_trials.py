"""Counts of what a door says of a sound trial, and the drawing of one."""

from benchmarks.sound_trials import commanded, digitise, facts_in, given, refusal


def test_a_trial_is_drawn_the_same_twice(tmp_path):
    """A different sheet or photo could move the count, which may only fall."""
    first, second = (given("close-up", tmp_path / name) for name in ("first", "second"))
    files = [[path.read_bytes() for path in (one.shown, one.shown.with_name("sheet.xlsx"))] for one in (first, second)]
    assert files[0][0] == files[1][0]
    assert "photo.ends_px" not in first.settings
    assert len(first.answered.settings["photo.ends_px"]) == 2
    shared = first.settings.keys() - {"readings.file"}
    assert all(first.settings[key] == second.settings[key] for key in shared)


def test_a_refused_call_is_one_refusal_and_a_question_only_if_it_asks(tmp_path):
    missing = commanded(
        "digitise", tmp_path / "photo.jpg", "--depth-mm", "9", "--mm-per-px", "0.1", out=tmp_path / "out"
    )
    assert missing.counts == (0, 0, 1)
    assert refusal(["photo.jpg: which line is the crack? Give ends."]).counts == (0, 1, 1)


def test_a_fact_at_any_depth_is_found_and_a_note_is_counted_once(tmp_path):
    fact = {"key": "a.b", "text": "A doubt.", "kind": "doubt", "level": "caution", "value": None, "unit": ""}
    assert [*facts_in({"sample": {"warnings": [fact]}, "text": "no fact"})] == [fact]
    reaction = digitise(given("mesh", tmp_path / "given"), tmp_path)
    assert reaction.counts == (len(set(reaction.cautions)), 0, 0)
    assert len(reaction.cautions) <= 2
