"""Stages run by a command, and their answer: the content of run.json and a few lines for people."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sealtwin.cli.answer import GATE_FAILED, Answer, Command

if TYPE_CHECKING:
    from sealtwin.trial.job import StageName
    from sealtwin.trial.trial_file import Trial


SAY_ORIGIN = "; photo.data or mesh.data declares it (measured, reconstructed, synthetic)."


def run_trial(
    command: Command,
    file: Path,
    out: Path | None,
    stages: "Sequence[StageName]",
    settings: Mapping[str, Any] | None = None,
    *,
    trial: "Trial | None" = None,
    threads: int = 1,
) -> None:
    """Run stages of a trial file, with ``settings`` by dotted name in place of its own, and answer.

    ``trial`` is the trial of a photo or a mesh, the ``file``, that has no trial file.
    """
    from sealtwin.lab.facts_above import facts_above
    from sealtwin.trial import pipeline
    from sealtwin.trial.trial_file import load_trial

    trial = trial or load_trial(file, settings)
    above = facts_above(trial, file.parent, compared="validate" in stages)
    with command.progress() as progress:
        result = pipeline.run_trial(trial, file.parent, out, stages, command.device, progress, threads, above).result
    _reply(command, result, stages)


def resume(
    command: Command,
    path: Path,
    stage: "StageName",
    settings: Mapping[str, Any],
    *,
    threads: int = 1,
    uncertainty: bool = False,
) -> None:
    """Run one stage of the trial that a run folder holds and answer; ``uncertainty`` adds its extra runs before.

    ``settings`` by dotted name replace those of RUN/trial.toml, which then records them.
    """
    from sealtwin.core.run_folder import open_folder
    from sealtwin.lab.facts_above import facts_above
    from sealtwin.trial.job import resume_job
    from sealtwin.trial.pipeline import run_stages

    with open_folder(path, create=False) as folder, command.progress() as progress:
        job = resume_job(folder, command.device, progress, settings)
        job = replace(job, above=facts_above(job.trial, job.source, compared=stage == "validate"), threads=threads)
        if uncertainty:
            from sealtwin.study.extra_runs import vary

            vary(job)
        result = run_stages(job, (stage,)).result
    _reply(command, result, (stage,))


def _reply(command: Command, result: dict[str, Any], stages: "Sequence[StageName]") -> None:
    missed = "validate" in stages and result.get("gate_passed") is False
    command.reply(Answer(result, result_lines(result, stages[-1]), GATE_FAILED if missed else 0))


def result_lines(result: dict[str, Any], last: "StageName") -> list[str]:
    """Return the lines that a person reads at the end of a command whose last stage was ``last``."""
    from validate.wording.headline import FAST

    lines = [*result["other_versions"]]
    if "length_mm" in result:
        lines.append(
            f"Crack: {result['length_mm']:.1f} mm long, {_width(result)} (path: {result['path_source']}); "
            f"{_cavity(result)}{_sealant(result)}."
        )
        if result["weighed"] is not None:
            from sealtwin.core.solid_figures import WeighedCavity

            weighed = WeighedCavity(**result["weighed"])
            lines.append(f"Cavity by weight ({len(weighed.levels_mm)} steps, 95 %): {weighed}.")
        lines.append(_scale(result))
        if result["data"] == "undeclared":
            lines.append(f"Origin of the {'mesh' if result['mm_per_px'] is None else 'photo'}: undeclared{SAY_ORIGIN}")
    if "particles" in result and last != "digitise":
        lines.append(
            f"Fluid: {result['particles']} particles, {result['escaped_particles']} escaped, "
            f"{result['spilled_particles']} spilled; volume ratio {result['volume_ratio']:.3f}; {result['device']}."
        )
        lines += result["fluid_warnings"]
    if "unfit" in result and last != "digitise":
        lines += ["Fluid: the fast model, without particles; for screening, never a level by itself.", *result["unfit"]]
        lines += (one for one in result["fluid_warnings"] if one not in result["unfit"] and not one.startswith(FAST))
    if "mean_error_mm" in result and last == "validate":
        lines += [
            *result["headline"],
            _worst(result),
            *_extra_runs(result),
            *result["findings"],
        ]
    elif result["edited"] and last == "validate":
        lines.append(f"Edited by hand since: {', '.join(result['edited'])}.")
    if last == "validate" and "report" in result and result["readings_role"] is None:
        lines.append(_predicted(result.get("predicted")))
    if last == "validate" and "expected" in result:
        lines += result["expected"]["told"]
    is_reported = last == "validate" and "report" in result
    return [*lines, f"Report: {result['report']}" if is_reported else f"Folder: {result['folder']}"]


def _predicted(found: dict[str, Any] | None) -> str:
    """Return what is known of a level that nothing was read of."""
    if found is None:
        return "No readings: this is the simulated fill alone, held against nothing."
    from validate.wording.prediction import predicted_sentence

    return predicted_sentence(**found)


def _width(result: dict[str, Any]) -> str:
    """Return the mean width with its interval, and its source unless that is the walls."""
    if result["mean_width_mm"] is None:
        return "a path alone, without walls or solid"
    said = {"walls": "", "fit": " by a fit of its profile", "gauge": " as given"}[result["width_source"]]
    interval = result["width_95_mm"]
    within = "" if interval is None else f", with 95 % from {interval[0]:.2g} to {interval[1]:.2g} mm"
    return f"{result['mean_width_mm']:.2f} mm wide{said}{within}"


def _sealant(result: dict[str, Any]) -> str:
    """Return the sealant to give; a path alone has a volume only where one is set."""
    return f"sealant {result['sealant_mm3'] / 1e3:.2f} ml" if result["sealant_mm3"] else "no sealant set (volume_ml)"


def _cavity(result: dict[str, Any]) -> str:
    if result["cavity_volume_mm3"] is None:
        return ""
    interval = result["cavity_volume_95_mm3"]
    within = "" if interval is None else f" ({interval[0] / 1e3:.2f} to {interval[1] / 1e3:.2f})"
    return f"cavity {result['cavity_volume_mm3'] / 1e3:.2f} ml{within}, "


def _extra_runs(result: dict[str, Any]) -> list[str]:
    """Return what the extra runs of --uncertainty found; nothing if there were none."""
    lines = []
    if (sizes := result["particle_sizes"]) is not None:
        errors = ", ".join(f"{error_mm:.2f}" for error_mm in sizes["mean_error_mm"])
        radii = ", ".join(f"{radius_mm:.3g}" for radius_mm in sizes["radii_mm"])
        band_mm, runs = sizes["band_95_mm"], ", ".join(map(str, sizes["runs"]))
        known = f"± {band_mm:.2f} mm (95 %)" if min(sizes["runs"]) > 1 else "one run each is no uncertainty"
        lines.append(f"Particle size: mean error {errors} mm at radii of {radii} mm, by {runs} runs: {known}.")
    if result["inputs_mm"]:
        from validate.units import MODELS
        from validate.wording.comparison import INPUTS

        effects = ", ".join(f"{INPUTS[name][0]} {effect:+.2f} mm" for name, effect in result["inputs_mm"].items())
        how = MODELS[result["inputs_model"]]
        lines.append(f"Inputs, each a standard uncertainty up, and what they do to the mean level {how}: {effects}.")
    return lines


def _scale(result: dict[str, Any]) -> str:
    """Return the scale's source, and what was measured of the scale unless it was given as a number."""
    facts = [result["scale_source"]]
    if result["scale_uncertainty"] is not None:
        facts += [f"{result['mm_per_px']:.4g} mm/px", f"uncertain by {100 * result['scale_uncertainty']:.2g} %"]
    if result["scale_residual_mm"] is not None:
        facts.append(f"residual {result['scale_residual_mm']:.3f} mm")
    if result["camera_tilt_deg"] is not None:
        facts.append(f"camera tilted {result['camera_tilt_deg']:.1f} degrees")
    return f"Scale: {', '.join(facts)}."


def _worst(result: dict[str, Any]) -> str:
    told = f"Worst error: {result['worst_error_mm']:.2f} mm (at s = {result['worst_at_mm']:.2f} mm)"
    if (station := result["worst_at_a_station"]) is None:
        return f"{told}."
    at_station = f"{station['error_mm']:.2f} mm (at s = {station['s_mm']:.2f} mm)"
    return f"{told}, where there is no reading; at a station at most {at_station}."
