"""What a trial of a lab has as 'sealtwin init' writes it, where nobody says it: its fluid, and a rest at the end."""

import tomllib
from collections.abc import Mapping, Set
from typing import Any

from sealtwin.trials.starter import TRIAL
from simulate.settings import Fluid

STARTER = tomllib.loads(TRIAL)


def started(said: Mapping[str, Any]) -> dict[str, Any]:
    """``said``, by dotted key, and the starter's besides.

    Without a rest the jet, still falling, would be taken for the sealant's level.
    """
    return {"solver.settle_s": STARTER["solver"]["settle_s"]} | _fluid(said) | dict(said)


def _fluid(said: Mapping[str, Any]) -> dict[str, Any]:
    """The starter's, of what nobody says: how thin the sealant is, and what holds its slope, either of two ways."""
    fluid = {f"fluid.{key}": value for key, value in STARTER["fluid"].items()}
    if "fluid.viscosity_pa_s" in said:
        del fluid["fluid.U"]
    if "fluid.freeze_after_s" in said:
        del fluid["fluid.yield_stress_pa"]
    return {key: value for key, value in fluid.items() if key not in said}


def remarks_on_fluid(said: Set[str], fluid: Fluid) -> list[str]:
    """What of ``fluid`` is the starter's, by the keys that notes have ``said``; or that nothing holds its slope."""
    if fluid.freeze_after_s == "never" and fluid.most_yield_stress_pa == 0:
        return [
            "nothing holds the sealant's slope, neither fluid.yield_stress_pa nor fluid.freeze_after_s: it ends level."
        ]
    taken = ", ".join(f"{key} = {value}" for key, value in _fluid(dict.fromkeys(said)).items())
    return [f"{taken}: the starter's, since no note says it. Write your own, best into lab.toml."] if taken else []
