"""Facts that a report states about a trial: verdict, cautions, volumes, uncertainty, assumptions, omissions."""

from collections.abc import Iterable, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from sealtwin.core.facts import Fact, Facts, doubt, of_keys, texts
from sealtwin.core.records import Run
from sealtwin.core.regime import SURFACE_TENSION_N_M
from sealtwin.core.run_figures import FAST
from validate.comparison import Outcome
from validate.intervals import ErrorUncertainty, PredictedLevel, StationErrors
from validate.metrics.verdict import POOL, SCREENING, case_of
from validate.result import NOT_A_VALIDATION, Evidence
from validate.run_facts import is_draft, levels_in_words, run_warnings, seed_facts
from validate.sentences import assumed, doubted, sentence, stated
from validate.uncertainty.meniscus import Mouth
from validate.uncertainty.validation import MEAN_LEVEL
from validate.units import LABELS, signed, unit_of, words

ML = 1000.0  # mm³
HEALTH_LABELS: dict[str, tuple[str, float, str]] = LABELS["health"]
"""Label, factor to the reported unit, and format of each figure that a run records about itself."""


def parts_of(evidence: Evidence) -> dict[str, Any]:
    """Return the values that several blocks of report_words.j2 use, by name."""
    run, m, p = evidence.run, evidence.comparison, evidence.prediction
    fast = run.fast_fill is not None
    return {
        "e": evidence,
        "m": m,
        "p": p,
        "case": case_of(m, run.escaped_particles, evidence.edited, fast=fast, predicted=p is not None),
        "ml": {location: volume_mm3 / ML for location, volume_mm3 in _volumes_mm3(run).items()},
        "room_ml": evidence.solid.cavity_volume_mm3 / ML,
        "levels": lambda noun: levels_in_words(evidence.seeds, noun),
        "other_levels": "" if p is None else other_levels(p),
    }


def headline(evidence: Evidence) -> tuple[Facts, Outcome]:
    """Return the facts of the verdict and its outcome."""
    if evidence.comparison is not None:
        return evidence.comparison.headline, evidence.comparison.outcome
    parts = parts_of(evidence)
    if parts["case"] == "leak":
        return (stated("verdict.leak", evidence.run.escaped_particles, level="fault", m=None),), "failed"
    if not evidence.run.has_particles:
        return (doubted(SCREENING, m=None, gate=None),), "open"
    if parts["case"] == "edited":
        edited = evidence.edited
        return (stated("verdict.edited", len(edited), level="fault", m=None, edited=edited),), "undecided"
    return (predicted(evidence.prediction),), "open"


def predicted(prediction: PredictedLevel | None) -> Fact:
    """Return a fact with the prediction or, if there is none, the fact that there are no readings."""
    if prediction is None:
        return stated("verdict.no-readings")
    others = other_levels(prediction)
    return stated("verdict.predicted", prediction.mean_level_mm, "mm", p=prediction, other_levels=others)


def other_levels(prediction: PredictedLevel) -> str:
    """Return a space and a sentence about the mean levels of the fast model and of the flat dispensed volume."""
    levels = {"the fast model": prediction.fast_level_mm, POOL: prediction.flat_level_mm}
    means = [
        f"{signed(float(np.trapezoid(level_mm)) / (len(level_mm) - 1), 2)} mm by {name}"
        for name, level_mm in levels.items()
        if level_mm is not None
    ]
    text = sentence("other_levels", levels=means)
    return f" {text}" if text else ""


def cautions(evidence: Evidence) -> Facts:
    """Return cautions about edited files, about the run, and about data that were not measured."""
    kinds = not_measured(evidence)
    return (*faults(evidence), *((doubted(NOT_A_VALIDATION, kinds=kinds),) if kinds else ()))


def faults(evidence: Evidence) -> Facts:
    """Return cautions about edited files, the run and the weighed cavity."""
    edited, weighed = evidence.edited, evidence.solid.figures.weighed
    questions = () if evidence.readings is None else evidence.readings.questions
    return (
        *((stated("files.edited", len(edited), level="fault", edited=edited),) if edited else ()),
        *(doubt("readings.doubt", f"{question}", question.kind) for question in questions if not question.is_remark),
        *run_warnings(evidence.run, evidence.volume_ratio, evidence.seeds),
        *(() if weighed is None else weighed.findings),
    )


def not_measured(evidence: Evidence) -> list[str]:
    """Return clauses about data that were not measured, or not declared. A validation has none."""
    readings_data = "measured" if evidence.readings is None else evidence.readings.data
    is_scan = evidence.readings is not None and evidence.readings.scan is not None
    readings = "the scan is" if is_scan else "the caliper readings are"
    things = {f"the {evidence.outline.seen_in} is": evidence.photo_data, readings: readings_data}
    clauses = [sentence("not_measured", thing=thing, data=data) for thing, data in things.items()]
    if evidence.comparison is not None and evidence.comparison.role == "undeclared":
        clauses.append(sentence("role_not_declared"))
    if evidence.comparison is not None and of_keys(evidence.outline.warnings, "scale.assumed"):
        clauses.append(sentence("not_measured", thing="the scale is", data="assumed"))
    return [clause for clause in clauses if clause]


def volumes(evidence: Evidence) -> Facts:
    """Return the volume of dispensed sealant in each part of the sample, in mm³."""
    fast = evidence.run.fast_fill is not None
    return tuple(
        Fact(f"volume.{location}", sentence("place", place=location, fast=fast), volume_mm3, "mm³", "figure")
        for location, volume_mm3 in _volumes_mm3(evidence.run).items()
    )


def _volumes_mm3(run: Run) -> dict[str, float]:
    if (filled := run.fast_fill) is not None:
        locations = "dispensed", "in_crack", "above_face", "in_flight"
        return {location: getattr(filled, f"{location}_mm3") for location in locations}
    height_mm = run.position_mm[~run.spilled, 2]
    counts = {
        "dispensed": len(run.position_mm),
        "in_crack": int((height_mm <= 0).sum()),
        "above_face": int((height_mm > 0).sum()),
        "spilled": run.spilled_particles,
        "escaped": run.escaped_particles,
    }
    return {location: count * run.particle_volume_mm3 for location, count in counts.items()}


def health_facts(evidence: Evidence) -> Facts:
    """Return the figures that a run recorded about itself."""
    return tuple(
        Fact(f"health.{key}", HEALTH_LABELS.get(key, (words(key),))[0], value, unit_of(key), "figure")
        for key, value in evidence.run.health.recorded().items()
        if isinstance(value, int | float | str)
    )


def uncertainty_facts(evidence: Evidence) -> Facts:
    """Return facts about several runs and about the uncertainty, or the fact that it was not assessed."""
    comparison, seeds = evidence.comparison, seed_facts(evidence.seeds, draft=is_draft(evidence.run))
    if evidence.prediction is not None:
        return *seeds, *prediction_facts(evidence.prediction)
    if comparison is not None and comparison.uncertainty is not None:
        return *seeds, *_included(comparison.uncertainty)
    return *seeds, stated("uncertainty.not-assessed", e=evidence)


def _included(uncertainty: ErrorUncertainty) -> Facts:
    """Return the result of the comparison, and what the intervals do not include."""
    draws = uncertainty.input_draws
    return (
        *of_keys(uncertainty.findings, MEAN_LEVEL),
        *uncertainty.budget.notes,
        *(() if uncertainty.budget.scatter_known else (doubted("uncertainty.scatter"),)),
        *(() if draws is None else (stated("uncertainty.draws", draws.runs),)),
        # The intervals of the error are due to the readings alone. The inputs are part of u_val.
        *_inputs(uncertainty.inputs_left_out, () if draws is None else draws.unfit, "u_val"),
    )


def prediction_facts(p: PredictedLevel) -> Facts:
    """Return facts about the parts of a prediction's band, and about the errors that the band does not include."""
    causes = list(dict.fromkeys(f"the {part.name}" if part.kind == "model" else part.kind for part in p.parts))
    facts = [stated("uncertainty.band", float(np.median(p.band_95_mm)), "mm", p=p, causes=causes)]
    if p.numerics_mm is None:
        facts.append(doubted("uncertainty.numerics"))
    by_fast = any(effect.model == FAST for effect in p.inputs)
    if p.fast_level_mm is None:
        facts.append(doubted("uncertainty.two-models", unfit=() if by_fast else texts(p.unfit)))
    missing = [part.name for part in p.missing]
    return (*facts, *_inputs(p.inputs_left_out, p.unfit if by_fast else (), "the band", missing))


def _inputs(left_out: Sequence[str], unfit: Sequence[Fact], whole: str, missing: Sequence[str] = ()) -> Iterable[Fact]:
    """Yield facts about inputs and ``missing`` errors not included in ``whole``, and about an invalid fast model."""
    if names := [*(LABELS["inputs"][name][0] for name in left_out), *missing]:
        yield assumed("uncertainty.left-out", len(names), whole=whole, names=names)
    if unfit:
        yield doubted("uncertainty.unfit", whole=whole, unfit=texts(unfit))


def stretches_off(stations: StationErrors) -> str:
    """Return a sentence about stretches of stations outside the band on the same side, worst first.

    Returns "" if there are no such stretches.
    """
    stretches, errors_mm = [], np.where(stations.off, stations.error_mm, 0.0)
    for side, group in groupby(range(len(errors_mm)), np.sign(errors_mm).tolist().__getitem__):
        part = [*group]
        worst = max(part, key=np.abs(errors_mm).__getitem__)
        first_mm, last_mm, at_mm = stations.s_mm[[part[0], part[-1], worst]]
        places_mm = {"from_mm": first_mm, "to_mm": last_mm, "at_mm": at_mm}
        stretches += [{"side": side, "worst_mm": abs(float(errors_mm[worst])), **places_mm}] if side else []
    return sentence("stretches_off", stretches=sorted(stretches, key=lambda stretch: -stretch["worst_mm"]))


def assumptions(evidence: Evidence) -> Facts:
    """Return the assumptions, with figures that show how much depends on them, and the data that no measure includes.

    A block that does not apply is empty.
    """
    outline, solid, run, readings = evidence.outline, evidence.solid, evidence.run, evidence.readings
    m, fluid = evidence.comparison, run.settings.get("fluid", {})
    repeats_mm = None if readings is None else readings.repeats_mm
    counts = {
        "stations": 0 if m is None or readings is None else len(m.basis.stations_beyond_mm),
        "readings": 0 if m is None or repeats_mm is None else int(np.isnan(repeats_mm).sum()),
        "spilled": run.spilled_particles,
        "branches": 0 if outline.branches_kept else len(outline.branches_mm),
        "fast": int(not run.has_particles),
    }
    counts["nothing"] = sum(counts.values())
    numbers: dict[str, tuple[Any, ...]] = {
        "assumed.tilt": (solid.cavity_volume_mm3 / run.dispensed_volume_mm3,),
        "assumed.slope": (),
        "assumed.surface-tension": (run.health.bond,),
        "assumed.meniscus": (_meniscus_mm(evidence), "mm"),
        "assumed.curve": (),
        "assumed.paste": (),
        "assumed.bingham": (fluid.get("yield_stress_pa"), "Pa"),
        "assumed.no-slip": (fluid.get("D_cm"), "cm"),
        "assumed.profile": (),
        "assumed.beside": (),
        "assumed.scale": (outline.scale_residual_mm, "mm"),
    }
    others = {
        "assumed.paste-doubt": (fluid.get("material") or {}).get("doubts", ()),
        "assumed.doubt": texts(run.doubts),
        "assumed.note": texts((*outline.warnings, *solid.figures.warnings)),
    }
    # Cured sealant has shrunk; the simulated sealant has not.
    as_read = "" if m is None or m.volumes is None else sentence("as_read", balance=m.volumes.mass_balance)
    parts = {"e": evidence, "m": m, "fluid": fluid, "slope": run.settings.get("sample"), "tilt": tilt_words(evidence)}
    parts |= {"tension_n_m": SURFACE_TENSION_N_M, "settled": _settled(evidence), "as_read": as_read}
    facts = [
        *(assumed(key, *number, **parts) for key, number in numbers.items()),
        *(assumed(key, text=text) for key, sentences in others.items() for text in sentences),
        *(assumed(f"left-out.{name}", count, **parts) for name, count in counts.items()),
    ]
    return tuple(fact for fact in facts if fact.text)


def tilt_words(evidence: Evidence) -> str:
    return sentence("tilt", solid=evidence.solid, angles=_angles(evidence))


def _angles(evidence: Evidence) -> str:
    left_deg, right_deg = evidence.solid.wall_angles_deg
    return sentence("angles", left=left_deg, right=right_deg)


def walls(evidence: Evidence) -> str:
    """Return a sentence about the width of the crack that the photo does not show, or "".

    It is the width of the mouth if the walls flare, and the width of the floor if they undercut.
    """
    solid = evidence.solid
    widths_mm = {"flare": solid.figures.mouth_width_mm, "undercut": solid.figures.floor_width_mm}
    if widths_mm.get(solid.tilt) is None:
        return ""
    return sentence(
        f"walls_{solid.tilt}", solid=solid, traced_mm=evidence.outline.mean_width_mm, angles=_angles(evidence)
    )


def freezing(evidence: Evidence) -> str:
    """Return a sentence about freezing by age. Returns "" if particles do not freeze."""
    freeze_s = evidence.run.settings.get("fluid", {}).get("freeze_after_s")
    return sentence("freezing", freeze_s=freeze_s) if isinstance(freeze_s, int | float) else ""


def _settled(evidence: Evidence) -> str:
    """Return how long the sealant settled after the last release: the set time, or the time until it was at rest."""
    health, path = evidence.run.health, evidence.trajectory
    settle_s, at_rest_s = evidence.run.settings.get("solver", {}).get("settle_s", 0.0), None
    flowing = np.flatnonzero(path.flow_mm3_s[:-1] > 0)
    if health.frames is not None and health.frame_s is not None and len(flowing):
        settled_s = health.frames * health.frame_s - float(path.t_s[flowing[-1] + 1] - path.t_s[0])
        at_rest_s = None if settled_s > settle_s - 0.1 else max(settled_s, 0.0)
    return sentence("settled", settle_s=settle_s, at_rest_s=at_rest_s)


def _meniscus_mm(evidence: Evidence) -> float | None:
    """Return the largest depth of a meniscus of water.

    Returns None if the uncertainty includes or names the meniscus.
    """
    profile, comparison = evidence.profile, evidence.comparison
    if evidence.prediction is not None or (comparison is not None and comparison.uncertainty is not None):
        return None
    mouth = Mouth.of(evidence.outline, evidence.solid, evidence.run.density_kg_m3)
    return float(mouth.sag_mm(profile.s_mm, profile.level_mm).max())
