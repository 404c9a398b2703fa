"""Tables of a paste."""

from tests.wrong_inputs.table import WrongInput

CASES: list[WrongInput] = []
