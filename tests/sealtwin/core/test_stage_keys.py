"""Keys of results, and the words on stage numbers."""

from sealtwin.core import stage_keys
from sealtwin.core.stage_keys import number_words, other_numbers, stage_key


def test_numbers_that_are_not_recorded_are_said_to_be_unknown():
    """A result of a version without stage numbers has none, and counts as computed by another one."""
    own = {"digitise": 1, "simulate": 2}
    assert other_numbers(own, own) == ""
    assert other_numbers({"digitise": 1, "simulate": 1}, own) == "simulate 1, while this version has simulate 2"
    assert other_numbers({}, own) == "digitise unknown, simulate unknown, while this version has digitise 1, simulate 2"
    assert number_words({}) == "unknown"


def test_the_keys_of_a_study_ask_for_the_version_once(monkeypatch):
    """It takes a millisecond, and 20,000 runs have two keys each."""
    asked = []
    stage_keys._own_version.cache_clear()
    monkeypatch.setattr(stage_keys, "version", lambda name: asked.append(name) or "1.0")
    assert len({stage_key({}, {"number": number}, {}) for number in range(50)}) == 50
    assert asked == ["sealtwin"]
    stage_keys._own_version.cache_clear()
