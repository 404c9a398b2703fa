import pytest

from tests.support.small_fluids import enclosed


@pytest.fixture(autouse=True)
def walls_once(monkeypatch):
    """Runs of one crack share its walls, which take most of the time before a first frame."""
    monkeypatch.setattr("simulate.injection.enclose", enclosed)
