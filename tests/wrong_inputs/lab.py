"""A lab's notes and folders."""

from tests.wrong_inputs.table import WrongInput

CASES: list[WrongInput] = []
