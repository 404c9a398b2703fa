"""Sheets of readings."""

from tests.wrong_inputs.table import WrongInput

CASES: list[WrongInput] = []
