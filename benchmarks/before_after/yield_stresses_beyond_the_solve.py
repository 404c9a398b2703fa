"""Yield stresses, and their growth, within the declared bounds: each runs, or is refused with values that do."""

import json
import re
from typing import Any

import sealtwin as st
from sealtwin.core.errors import NumericalError
from tests.fluids import path, slot

DENSITY_KG_M3 = 664.0  # At 1690 a pour of 10,000 Pa fails as well, but in few of many
REMEDIES = {"yield_stress_most_pa": r"most_pa of at most ([\d.e+]+)", "substeps": r"at least (\d+)"}


def ends(key: str, value: float, substeps: int | None = None, **more: float) -> str:
    """Return how a pour of a fluid ends."""
    wide = key == "yield_stress_pa"
    solid, crack = slot(24.0, width_mm=5.0 if wide else 3.1, depth_mm=12.0)
    trajectory = path(crack, 0.08, speed_mm_s=30.0) if wide else path(crack, 1.2)
    law: dict[str, Any] = (
        {"viscosity_pa_s": 1.0, key: value} | ({"density_kg_m3": DENSITY_KG_M3} if wide else {}) | more
    )
    try:
        st.inject(crack, solid, trajectory, st.Fluid(**law), solver=st.Solver(radius_mm=0.48, substeps=substeps))
    except NumericalError:
        return "fails"
    except st.InputError as refused:
        return str(refused)
    return "runs"


def ends_again(key: str, value: float) -> str:
    """Return how a pour ends; if it is refused, how one with each value that the refusal names ends."""
    if (answer := ends(key, value)) in ("fails", "runs"):
        return answer
    named = {}
    for remedy, words in {key: r"Give at most ([\d.e+]+)", **REMEDIES}.items():
        if found := re.search(words, answer):
            named[remedy] = float(found[1].rstrip("."))
    after = []
    for remedy, allowed in named.items():
        if remedy == key:
            ended = ends(key, allowed)
        elif remedy == "substeps":
            ended = ends(key, value, substeps=int(allowed))
        else:
            ended = ends(key, value, yield_stress_most_pa=allowed)
        after.append(f"{remedy} {allowed:g} {ended if ended == 'runs' else 'fails'}")
    return f"refused, {', '.join(after) or 'which fails to name a value'}"


cases = [("yield_stress_pa", 1e4), ("structuration_pa_per_s", 450.0), ("structuration_pa_per_s", 1000.0)]
line = "; ".join(f"{key} = {value:g} {ends_again(key, value)}" for key, value in cases)
print(json.dumps({"line": line, "sound": "fails" not in line}))
