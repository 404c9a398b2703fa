"""Caches, edited files, links and names."""

from tests.wrong_inputs.table import WrongInput

CASES: list[WrongInput] = []
