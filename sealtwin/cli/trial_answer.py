"""Run stages for a command, and print their result: the content of run.json, or text."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sealtwin.cli.answer import GATE_FAILED, Answer, Command

if TYPE_CHECKING:
    from sealtwin.trial.job import StageName
    from sealtwin.trial.trial_file import Trial
    from validate.comparison import ErrorUncertainty
    from validate.result import Comparison, FluidFigures, PredictedLevel, SampleFigures, TrialResult


SAY_ORIGIN = ".data declares it (measured, reconstructed, synthetic)."


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
    """Run stages of a trial file, with ``settings`` by dotted name that replace its own, and print the result.

    If ``trial`` is given, ``file`` is the photo or the mesh for which it was made.
    """
    from sealtwin.core.cluster import cores
    from sealtwin.lab.held_out import facts_above
    from sealtwin.trial import pipeline
    from sealtwin.trial.trial_file import load_trial

    trial = trial or load_trial(file, settings)
    above = facts_above(trial, file.parent, compared="validate" in stages, jobs=cores())
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
    """Run one stage of a run folder's trial and print the result. ``uncertainty`` makes the extra runs first.

    ``settings`` by dotted name replace those of RUN/trial.toml, which then records them.
    """
    from sealtwin.core.cluster import cores
    from sealtwin.core.run_folder import open_folder
    from sealtwin.lab.held_out import facts_above
    from sealtwin.trial.job import resume_job
    from sealtwin.trial.pipeline import run_stages

    with open_folder(path, create=False) as folder, command.progress() as progress:
        job = resume_job(folder, command.device, progress, settings)
        above = facts_above(job.trial, job.source, compared=stage == "validate", jobs=cores())
        job = replace(job, above=above, threads=threads)
        if uncertainty:
            from sealtwin.study.extra_runs import vary

            vary(job)
        result = run_stages(job, (stage,)).result
    _reply(command, result, (stage,))


def _reply(command: Command, result: "TrialResult", stages: "Sequence[StageName]") -> None:
    missed = "validate" in stages and result.comparison is not None and result.comparison.passed is False
    content = result.model_dump(mode="json")
    command.reply(Answer(content, result_lines(result, stages[-1]), GATE_FAILED if missed else 0))


def result_lines(result: "TrialResult", last: "StageName") -> list[str]:
    """Return the lines that describe a result, after a command whose last stage was ``last``."""
    lines = [*result.other_versions]
    if result.sample is not None:
        lines += _sample(result.sample)
    if result.fluid is not None and last != "digitise":
        lines += _fluid(result.fluid)
        if result.seeds is not None:
            from validate.wording.seeds import mean_sentence

            lines.append(mean_sentence(result.seeds))
    if last != "validate" or result.report is None:
        return [*lines, f"Folder: {result.folder}"]
    if result.comparison is not None:
        lines += _compared(result.comparison)
    elif result.edited:
        from validate.metrics.verdict import edited_by_hand

        lines.append(f"{edited_by_hand(result.edited)}.")
    if result.comparison is None:
        lines.append(_without_readings(result.prediction))
    if result.earlier_trials is not None:
        from validate.uncertainty.earlier_trials import expected_sentences

        lines += expected_sentences(result.earlier_trials)
    return [*lines, f"Report: {result.report}"]


def _sample(sample: "SampleFigures") -> Iterator[str]:
    sealant_mm3 = sample.sealant_mm3
    sealant = f"sealant {sealant_mm3 / 1e3:.2f} ml" if sealant_mm3 else "no sealant set (volume_ml)"
    yield (
        f"Crack: {sample.length_mm:.1f} mm long, {_width(sample)} (path: {sample.path_source}); "
        f"{_cavity(sample)}{sealant}."
    )
    if sample.weighed is not None:
        yield f"Cavity by weight ({len(sample.weighed.levels_mm)} steps, 95 %): {sample.weighed}."
    yield _scale(sample)
    if sample.data == "undeclared":
        kind = "mesh" if sample.mm_per_px is None else "photo"
        yield f"Origin of the {kind}: undeclared; {kind}{SAY_ORIGIN}"


def _width(sample: "SampleFigures") -> str:
    """Return the mean width with its interval, and with its source if it was not measured between the walls."""
    if sample.mean_width_mm is None:
        return "a path alone, without walls or solid"
    sources = {"region": " between the rims of a dark region", "fit": " by a fit of its profile", "gauge": " as given"}
    source = sources.get(sample.width_source, "")
    interval = sample.width_95_mm
    within = "" if interval is None else f", with 95 % from {interval[0]:.2g} to {interval[1]:.2g} mm"
    return f"{sample.mean_width_mm:.2f} mm wide{source}{within}"


def _cavity(sample: "SampleFigures") -> str:
    if sample.cavity_volume_mm3 is None:
        return ""
    interval = sample.cavity_volume_95_mm3
    within = "" if interval is None else f" ({interval[0] / 1e3:.2f} to {interval[1] / 1e3:.2f})"
    return f"cavity {sample.cavity_volume_mm3 / 1e3:.2f} ml{within}, "


def _scale(sample: "SampleFigures") -> str:
    """Return the scale's source, and its measured figures unless it was given as a number."""
    facts = [sample.scale_source]
    if sample.scale_uncertainty is not None:
        facts += [f"{sample.mm_per_px:.4g} mm/px", f"uncertain by {100 * sample.scale_uncertainty:.2g} %"]
    if sample.scale_residual_mm is not None:
        facts.append(f"residual {sample.scale_residual_mm:.3f} mm")
    if sample.camera_tilt_deg is not None:
        facts.append(f"camera tilted {sample.camera_tilt_deg:.1f} degrees")
    return f"Scale: {', '.join(facts)}."


def _fluid(fluid: "FluidFigures") -> list[str]:
    from validate.wording.headline import FAST

    if (unfit := fluid.unfit) is None:
        counts = f"{fluid.particles} particles, {fluid.escaped_particles} escaped, {fluid.spilled_particles} spilled"
        return [f"Fluid: {counts}; volume ratio {fluid.volume_ratio:.3f}; {fluid.device}.", *fluid.warnings]
    others = [one for one in fluid.warnings if one not in unfit and not one.startswith(FAST)]
    return ["Fluid: fast model, without particles; for screening only, not as a result.", *unfit, *others]


def _compared(comparison: "Comparison") -> list[str]:
    worst = f"Worst error: {comparison.worst_error_mm:.2f} mm (at s = {comparison.worst_at_mm:.2f} mm)"
    if (station := comparison.worst_at_a_station) is not None:
        at_station = f"{station.error_mm:.2f} mm (at s = {station.s_mm:.2f} mm)"
        worst += f", where there is no reading; the worst at a station is {at_station}"
    runs = [] if comparison.uncertainty is None else _extra_runs(comparison.uncertainty)
    return [*comparison.headline, f"{worst}.", *runs, *comparison.findings]


def _extra_runs(uncertainty: "ErrorUncertainty") -> Iterator[str]:
    """Yield the results of the extra runs of --uncertainty, if there are any."""
    from validate.units import MODELS
    from validate.wording.comparison import INPUTS

    if (sizes := uncertainty.numerics) is not None:
        error = sizes.mean_error_mm
        errors = ", ".join(f"{error_mm:.2f}" for error_mm in error.values)
        radii = ", ".join(f"{radius_mm:.3g}" for radius_mm in sizes.radii_mm)
        runs = ", ".join(map(str, error.runs))
        band = f"± {error.band:.2f} mm (95 %)"
        yield f"Particle size: mean error {errors} mm at radii of {radii} mm, from {runs} runs: {band}."
    if inputs := uncertainty.inputs:
        effects = ", ".join(f"{INPUTS[one.name][0]} {one.mean_level_mm:+.2f} mm" for one in inputs)
        how = MODELS[inputs[0].model]
        yield f"Effect on the mean level {how} of each input, if it is larger by one standard uncertainty: {effects}."


def _without_readings(prediction: "PredictedLevel | None") -> str:
    if prediction is None:
        return "No readings: the simulated fill is not compared with anything."
    from validate.wording.prediction import predicted_sentence

    return predicted_sentence(prediction)
