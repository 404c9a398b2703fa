"""Settings of a trial that no note of a lab gives."""

import tomllib
from collections.abc import Set
from typing import Any

from sealtwin.lab.sample_outcome import SampleOutcome
from sealtwin.trial.quick_trial import ASSUMED, toml_value
from sealtwin.trial.starter_files import TRIAL
from sealtwin.trial.trial_file import Trial, with_settings

STARTER = tomllib.loads(TRIAL)
ANGLE, FILL = "crack.wall_angle_deg", "crack.fill"
UNSEEN = {"crack.tilt": "lean", ANGLE: 11.0}
"""Settings of the crack's walls that no photo shows, with the values that are used if no note gives any."""


def fluid_settings(settings: Set[str]) -> dict[str, Any]:
    """Return the fluid's settings as in 'sealtwin init', without those that are given or that a given one excludes."""
    given = {key: 0 for key in settings if key.startswith("fluid.")}
    remaining = with_settings({"fluid": STARTER["fluid"]}, given)["fluid"]
    if "fluid.freeze_after_s" in settings:
        remaining.pop("yield_stress_pa", None)
    return {f"fluid.{key}": value for key, value in remaining.items() if f"fluid.{key}" not in settings}


def rest_of(outcome: SampleOutcome) -> dict[str, Any]:
    """Return values of path, nozzle and solver that are not given and that 'sealtwin quick' marks as assumed."""
    settings = outcome.note.entries
    tables: dict[str, Any] = {table: Trial.model_fields[table].default for table in ("path", "nozzle", "solver")}
    names = [name.partition(".") for name in ASSUMED]
    values = {f"{table}.{key}": getattr(tables[table], key) for table, _, key in names if table in tables}
    values |= solver_settings()
    replaced = {
        "path.plan": "path.",
        "path.weighed": "path.volume_ml",
        "solver.model": "solver.",  # The fast model has neither particles nor a rest.
    }
    without = tuple(prefix for key, prefix in replaced.items() if key in settings)
    return {key: value for key, value in values.items() if key not in settings and not key.startswith(without)}


def solver_settings() -> dict[str, Any]:
    return {f"solver.{key}": STARTER["solver"][key] for key in ("radius_mm", "settle_s")}


def assumed_of(outcome: SampleOutcome) -> str:
    """Return the trial's note for the report. It lists settings that no note of the lab gives; "" if there are none."""
    settings = {*outcome.note.entries, *([ANGLE] if "fill" in outcome.sample.files else [])}
    crack = {key: value for key, value in UNSEEN.items() if key not in settings}
    assumed = {**crack, **fluid_settings(settings), **rest_of(outcome)}
    listed = ", ".join(f"{key} = {toml_value(value)}" for key, value in assumed.items())
    return f"Assumed, since no note of the lab gives it: {listed}." if listed else ""
