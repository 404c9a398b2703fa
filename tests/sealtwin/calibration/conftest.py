"""A search with as many draws as the claims of these tests need."""

import pytest

from sealtwin.calibration import search


@pytest.fixture
def few_steps(monkeypatch):
    monkeypatch.setattr(search, "STEPS", 150)
    monkeypatch.setattr(search, "STEPS_OF_A_ROUND", 40)
