"""Photos, masks, meshes and drawings."""

from tests.wrong_inputs.table import WrongInput

CASES: list[WrongInput] = []
