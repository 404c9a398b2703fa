"""Data of the chapter "Try other settings", from the fast model and from the report."""

from typing import Any

import numpy as np

from sealtwin.core.records import Floats
from validate.report_input import Evidence
from validate.wording.comparison import volumes_mm3

MOST_PLACES = 1000  # Most points of a line on the page
PARTS = ("numerics", "inputs")  # Parts of the budget that concern the simulated level


def live_chapter(evidence: Evidence) -> dict[str, Any] | None:
    """Return the input of the page's script (finite numbers and text), or None without a fast model of the trial."""
    if (live := evidence.live) is None:
        return None
    profile, readings, run = evidence.profile, evidence.readings, evidence.run
    finite = np.isfinite(profile.level_mm)
    s_mm, level_mm = profile.s_mm[finite], profile.level_mm[finite]
    at_mm = s_mm if len(s_mm) <= MOST_PLACES else np.linspace(s_mm[0], s_mm[-1], MOST_PLACES)
    above = volumes_mm3(evidence)["above_face"][1]
    return live.model_dump(mode="json") | {
        "by_particles": run.has_particles,
        "as_run": {"s_mm": _rounded(at_mm), "level_mm": _rounded(np.interp(at_mm, s_mm, level_mm))},
        "above_mm3": above + run.spilled_particles * run.particle_volume_mm3,
        "readings": None if readings is None else _line(readings.s_mm, readings.level_mm),
        "band": _band(evidence),
        "sentences": _sentences(evidence),
        "seen_in": evidence.outline.seen_in,
    }


def _band(evidence: Evidence) -> dict[str, Any] | None:
    """Return the half-width of the simulated level's 95 % band along the crack, and the parts of the budget in it."""
    uncertain = evidence.prediction
    if evidence.comparison is not None and (uncertainty := evidence.comparison.uncertainty) is not None:
        uncertain = uncertainty.stations
    if uncertain is None or not evidence.run.has_particles:
        return None
    parts = {name: part for name in PARTS if (part := getattr(uncertain, f"{name}_mm")) is not None}
    if not parts:
        return None
    half_mm = 2 * np.sqrt(np.sum([np.square(part) for part in parts.values()], axis=0))
    return {"parts": list(parts), **_line(uncertain.s_mm, half_mm)}


def _sentences(evidence: Evidence) -> list[str]:
    """Return sentences on the model of the page's level, on its band, and on the readings."""
    if evidence.run.has_particles:
        level = "level of the particles as run"
        if evidence.seeds is not None:
            level = f"mean level of the {len(evidence.seeds.seeds)} runs by particles"
        sentences = [f"This is the {level}, plus the change that the fast model computes."]
        band = _band(evidence)
        sentences.append(
            "No band: the uncertainty of this simulation was not computed."
            if band is None
            else f"The 95 % band includes {' and '.join(band['parts'])}, for the settings as run."
        )
    else:
        sentences = [
            "The fast model computed this level and that of the run. There is no band, since only a run with particles "
            "shows its error."
        ]
    return sentences if evidence.readings is None else [*sentences, "The readings are for the settings as run."]


def _line(s_mm: Floats, values_mm: Floats) -> dict[str, list[float]]:
    """Return a line's finite points, thinned if they are more than ``MOST_PLACES``."""
    finite = np.isfinite(values_mm)
    every = slice(None, None, int(np.ceil(max(1, finite.sum()) / MOST_PLACES)))
    return {"s_mm": _rounded(s_mm[finite][every]), "level_mm": _rounded(values_mm[finite][every])}


def _rounded(values: Floats) -> list[float]:
    return np.round(values, 6).tolist()
