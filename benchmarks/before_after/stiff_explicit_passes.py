"""Pastes by explicit passes: each ends in its time, or is refused with a value that does."""

import json
import multiprocessing
import re

import sealtwin as st
from tests.fluids import path, slot

PATIENCE_S = 60.0  # A pour of 36 particles


def ends(key: str, value: float) -> str:
    law = {"viscosity_pa_s": 0.1} | {key: value}
    solid, crack = slot(16.0, width_mm=5.0, depth_mm=8.0)
    solver = st.Solver(radius_mm=0.6, viscosity_solve="explicit")
    try:
        st.inject(crack, solid, path(crack, 0.04, speed_mm_s=60.0), st.Fluid.model_validate(law), solver=solver)
    except st.InputError as refused:
        return str(refused)
    return "runs"


def in_time(key: str, value: float) -> str:
    with multiprocessing.Pool(1) as pool:
        try:
            return pool.apply_async(ends, (key, value)).get(PATIENCE_S)
        except multiprocessing.TimeoutError:
            return f"fails to end in {PATIENCE_S:g} s"


def ends_again(key: str, value: float) -> str:
    """Return how a pour ends; if it is refused, how one of the largest value that the refusal names ends."""
    if (answer := in_time(key, value)).startswith(("fails", "runs")):
        return answer
    named = re.search(r"at most ([\d.e+]+)", answer)
    if not named:
        return "refused, fails to name a value"
    ended = in_time(key, float(named[1].rstrip(".")))
    return f"refused, {named[1]} {ended if ended == 'runs' else 'fails'}"


if __name__ == "__main__":
    cases = [("yield_stress_pa", 0.1), ("yield_stress_pa", 9000.0)]
    line = "; ".join(f"{key} = {value:g} {ends_again(key, value)}" for key, value in cases)
    print(json.dumps({"line": line, "sound": "fails" not in line}))
