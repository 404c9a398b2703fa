"""The demo runs the fixture's own files."""

from sealtwin.trial.starter_files import DEMO, place_paper_trial
from tests.places import FIXTURE


def test_the_demo_copies_the_fixture_to_the_byte_and_may_be_repeated(tmp_path):
    for _ in range(2):
        place_paper_trial(tmp_path)
        assert sorted(path.name for path in tmp_path.iterdir()) == sorted(DEMO)
        assert all((tmp_path / name).read_bytes() == (FIXTURE / name).read_bytes() for name in DEMO)
