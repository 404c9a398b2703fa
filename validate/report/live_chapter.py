"""The chapter of the page in which other settings are tried: the fast model's data beside those of the report."""

from typing import Any

import numpy as np

from sealtwin.core.records import Floats
from validate.report_input import Evidence
from validate.wording.comparison import volumes_mm3

MOST_PLACES = 1000  # Of a line on the page
PARTS = ("numerics", "inputs")  # Parts of the budget that are of the simulated level


def live_chapter(evidence: Evidence) -> dict[str, Any] | None:
    """Return what the page's script reads, finite numbers and text; None where the fast model cannot do the trial."""
    if (live := evidence.live) is None:
        return None
    profile, readings, run = evidence.profile, evidence.readings, evidence.run
    known = np.isfinite(profile.level_mm)
    s_mm, level_mm = profile.s_mm[known], profile.level_mm[known]
    at_mm = s_mm if len(s_mm) <= MOST_PLACES else np.linspace(s_mm[0], s_mm[-1], MOST_PLACES)
    above = volumes_mm3(evidence)["above_face"][1]
    return live.model_dump(mode="json") | {
        "by_particles": run.has_particles,
        "as_run": {"s_mm": _rounded(at_mm), "level_mm": _rounded(np.interp(at_mm, s_mm, level_mm))},
        "above_mm3": above + run.spilled_particles * run.particle_volume_mm3,
        "readings": None if readings is None else _line(readings.s_mm, readings.level_mm),
        "band": _band(evidence),
        "sentences": _sentences(evidence),
        "beside": evidence.outline.seen_in,
    }


def _band(evidence: Evidence) -> dict[str, Any] | None:
    """Return the half-width of 95 % of the simulated level along the crack, by what the budget has of it."""
    found = evidence.prediction
    if evidence.comparison is not None and (against := evidence.comparison.uncertainty) is not None:
        found = against.stations
    if found is None or not evidence.run.has_particles:
        return None
    parts = {name: getattr(found, f"{name}_mm") for name in PARTS}
    if not (held := {name: part for name, part in parts.items() if part is not None}):
        return None
    half_mm = 2 * np.sqrt(np.sum([np.square(part) for part in held.values()], axis=0))
    return {"parts": list(held), **_line(found.s_mm, half_mm)}


def _sentences(evidence: Evidence) -> list[str]:
    """Sentences on what made the page's level, its band and the readings beside it."""
    if evidence.run.has_particles:
        told = ["The level of the particles as run, plus the change that the fast model gives for these settings."]
        band = _band(evidence)
        held = "" if band is None else " and ".join(band["parts"])
        told.append(
            "No band: the uncertainty of this simulation was not computed."
            if band is None
            else f"The band is 95 % by {held}, of the settings as run."
        )
    else:
        told = [
            "This level is by the fast model, as is that of the run. It has no band: only a run by particles shows "
            "how far off it is."
        ]
    return told if evidence.readings is None else [*told, "The readings are of the settings as run."]


def _line(s_mm: Floats, values_mm: Floats) -> dict[str, list[float]]:
    """Return a line's finite points, thinned where they are more than a page can show."""
    known = np.isfinite(values_mm)
    every = slice(None, None, int(np.ceil(max(1, known.sum()) / MOST_PLACES)))
    return {"s_mm": _rounded(s_mm[known][every]), "level_mm": _rounded(values_mm[known][every])}


def _rounded(values: Floats) -> list[float]:
    return np.round(values, 6).tolist()
