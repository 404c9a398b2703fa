"""The stiffest fluids within the declared bounds: each runs, or is refused before the run with a value that does."""

import json
import re

import sealtwin as st
from sealtwin.core.errors import NumericalError
from tests.fluids import path, slot

solid, crack = slot(24.0, depth_mm=12.0)


def ends(key: str, value: float, *, again: bool = True) -> str:
    """Return how a pour of a fluid ends; after a refusal, how one of the largest value that it names ends."""
    try:
        fluid = st.Fluid(U=value) if key == "U" else st.Fluid(viscosity_pa_s=value)
        st.inject(crack, solid, path(crack, 0.2, speed_mm_s=20.0), fluid, solver=st.Solver(radius_mm=0.6))
    except NumericalError:
        return "fails"
    except st.InputError as refused:
        (most, *_) = re.findall(r"at most ([\d.e+]+)", str(refused))
        allowed = float(most.rstrip("."))
        return f"refused, {allowed:g} {ends(key, allowed, again=False)}" if again else "fails"
    return "runs"


cases = [("U", 1e5), ("U", 1e6), ("viscosity_pa_s", 1e3), ("viscosity_pa_s", 1e4)]
answers = {f"{key} = {value:g}": ends(key, value) for key, value in cases}
line = "; ".join(f"{case} {answer}" for case, answer in answers.items())
print(json.dumps({"line": line, "sound": "fails" not in line}))
