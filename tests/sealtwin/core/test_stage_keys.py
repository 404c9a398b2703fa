"""Keys of results, and the words on stage numbers."""

from sealtwin.core.run_folder import number_words, other_numbers


def test_numbers_that_are_not_recorded_are_said_to_be_unknown():
    """A result of a version without stage numbers has none, and counts as computed by another one."""
    own = {"digitise": 1, "simulate": 2}
    assert other_numbers(own, own) == ""
    assert other_numbers({"digitise": 1, "simulate": 1}, own) == "simulate 1, while this version has simulate 2"
    assert other_numbers({}, own) == "digitise unknown, simulate unknown, while this version has digitise 1, simulate 2"
    assert number_words({}) == "unknown"
