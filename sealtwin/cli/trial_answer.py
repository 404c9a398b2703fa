"""Run stages for a command, and print their result: the content of run.json, or text."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sealtwin.cli.answer import GATE_FAILED, Answer, Command

if TYPE_CHECKING:
    from sealtwin.core.progress import Warned
    from sealtwin.trial.job import StageName
    from sealtwin.trial.pipeline import FinishedStages
    from sealtwin.trial.trial_file import Trial
    from validate.comparison import ErrorUncertainty
    from validate.result import Comparison, FluidFigures, PredictedLevel, SampleFigures, TrialResult

Rows = Iterator[tuple[str, str]]  # A label and a text; equal labels that follow each other are printed once
LABEL_LETTERS = 9  # Width of the column of labels
LEAST_MM3 = 200.0  # Volume above the face from which it is printed
HEADLINE = 3  # Sentences of a headline with figures; a comparison without a valid mean error has fewer

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
    warned: "Sequence[Warned]" = (),
) -> None:
    """Run stages of a trial file, with ``settings`` by dotted name that replace its own, and print the result.

    If ``trial`` is given, ``file`` is the photo or the mesh for which it was made. The command has printed the
    warnings ``warned`` before.
    """
    from sealtwin.core.cluster import cores
    from sealtwin.study.extra_runs import by_studies
    from sealtwin.trial import pipeline
    from sealtwin.trial.trial_file import load_trial

    made, trial = trial is not None, trial or load_trial(file, settings)
    with command.progress() as progress:
        above = by_studies(cores())
        done = pipeline.run_trial(trial, file.parent, out, stages, command.device, progress, threads, above)
    _reply(command, done, stages, (*warned, *progress.warned), "TRIAL" if made else file.as_posix())


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
    from sealtwin.study.extra_runs import by_studies, vary
    from sealtwin.trial.job import resume_job
    from sealtwin.trial.pipeline import run_stages

    with open_folder(path, create=False) as folder, command.progress() as progress:
        job = resume_job(folder, command.device, progress, settings)
        job = replace(job, above=by_studies(cores()), threads=threads)
        if uncertainty:
            vary(job)
        done = run_stages(job, (stage,))
    _reply(command, done, (stage,), progress.warned, "TRIAL")


def _reply(
    command: Command, done: "FinishedStages", stages: "Sequence[StageName]", warned: "Sequence[Warned]", trial_file: str
) -> None:
    result = done.result
    missed = "validate" in stages and result.comparison is not None and result.comparison.passed is False
    lines = result_lines(result, stages[-1], done.extra_runs, warned, verbose=command.verbose)
    if "validate" in stages and result.comparison is None and done.can_be_planned:
        lines.append(
            f"{'Next':<{LABEL_LETTERS}}'sealtwin plan {trial_file}' searches for a flow that fills this crack better"
        )
    command.reply(Answer(result.model_dump(mode="json"), lines, GATE_FAILED if missed else 0))


def result_lines(
    result: "TrialResult",
    last: "StageName",
    extra_runs: str = "",
    warned: "Sequence[Warned]" = (),
    *,
    verbose: bool = False,
) -> list[str]:
    """Return the lines that describe a result, after a command whose last stage was ``last``.

    Args:
        result: Result of the trial.
        last: Last stage of the command.
        extra_runs: Time of the runs of 'sealtwin validate RUN --uncertainty' in words; empty if it is unknown.
        warned: Warnings that the command has printed. They are not repeated.
        verbose: True for all figures and sentences.
    """
    compared = last == "validate" and result.report is not None
    rows = [
        *_made(result, last),
        *(("Warning", text) for text in _warnings(result, last) if text not in {warning.text for warning in warned}),
        *(_concluded(result) if compared else ()),
    ]
    hint = _hint(result, extra_runs) if compared else ""
    rows.append(("Report", f"{result.report}{hint}") if compared else ("Folder", result.folder))
    if verbose:
        rows += [("Details", text) for text in _details(result, last, compared=compared)]
    return [
        f"{label if number == 0 else '':<{LABEL_LETTERS}}{text}"
        for label, group in groupby(rows, key=lambda row: row[0])
        for number, (_, text) in enumerate(group)
    ]


def _made(result: "TrialResult", last: "StageName") -> Rows:
    """Yield rows on the sample, and on the fluid if ``last`` is a later stage than digitising."""
    sample, fluid = result.sample, None if last == "digitise" else result.fluid
    if sample is not None:
        sealant = f"{sample.sealant_mm3 / 1e3:.2f} ml {'to pour' if fluid is None else 'poured'}"
        room = f"{_cavity(sample)}{sealant}" if sample.sealant_mm3 else "no sealant set (path.volume_ml)"
        yield "Crack", f"{sample.length_mm:.1f} mm long, {_width(sample)}; {room}"
        if sample.weighed is not None:
            yield "Cavity", f"by weight ({len(sample.weighed.levels_mm)} steps, 95 %): {sample.weighed}"
        if last == "digitise":
            yield "Scale", ", ".join(_scale(sample))
    if fluid is not None:
        yield from (("Fluid", text) for text in (_fluid(fluid), *(fluid.unfit or ())))
        if result.seeds is not None:
            from validate.wording.of_runs import mean_sentence

            yield "Seeds", mean_sentence(result.seeds)


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
    return f"room for {sample.cavity_volume_mm3 / 1e3:.2f} ml{within}, "


def _scale(sample: "SampleFigures") -> Iterator[str]:
    """Yield the scale's source, and its measured figures unless it was given as a number."""
    yield sample.scale_source
    if sample.scale_uncertainty is not None:
        yield f"{sample.mm_per_px:.4g} mm/px"
        yield f"uncertain by {100 * sample.scale_uncertainty:.2g} %"


def _fluid(fluid: "FluidFigures") -> str:
    if fluid.unfit is not None:
        fit = "UNFIT for this case" if fluid.unfit else "without particles"
        return f"fast model, {fit}; for screening only, not as a result"
    from validate.units import counted

    escaped = counted(fluid.escaped_particles, "particle") if fluid.escaped_particles else "no particle"
    spilled = fluid.spilled_particles
    if not spilled and fluid.above_face_mm3 < LEAST_MM3:
        return f"{escaped} escaped"
    over = f"{counted(spilled, 'particle') if spilled else 'none'} ran over the sample's edge"
    return f"{escaped} escaped; {fluid.above_face_mm3 / 1e3:.1f} ml are above the face, {over}"


def _warnings(result: "TrialResult", last: "StageName") -> Iterator[str]:
    """Yield sentences on what makes the result unsound or unreliable."""
    yield from result.other_versions
    if (sample := result.sample) is not None:
        yield from sample.warnings
        if sample.data == "undeclared":
            kind = "mesh" if sample.mm_per_px is None else "photo"
            yield f"Origin of the {kind}: undeclared; {kind}{SAY_ORIGIN}"
    if (fluid := result.fluid) is not None and last != "digitise":
        from validate.wording.headline import FAST

        # The rows on the fluid have the reasons, and the rest in fewer words.
        yield from (text for text in fluid.warnings if text not in (fluid.unfit or ()) and not text.startswith(FAST))
    if last == "validate":
        if result.comparison is None and result.edited:
            from validate.metrics.verdict import edited_by_hand

            yield f"{edited_by_hand(result.edited)}."
        if result.comparison is not None and result.comparison.uncertainty is not None:
            yield from result.comparison.uncertainty.unused


def _concluded(result: "TrialResult") -> Rows:
    """Yield rows on the comparison or the prediction."""
    if result.comparison is not None:
        yield from (("Result", text) for text in _compared(result.comparison))
        yield "Gate", _gate(result.comparison)
    else:
        yield "Result", _without_readings(result.prediction)


def _compared(m: "Comparison") -> Iterator[str]:
    """Yield a line on the mean error and the readings, one on baselines and stations, and one on the worst error.

    If the mean error is not valid, the lines are the sentences that say why.
    """
    if len(m.headline) < HEADLINE:
        yield from m.headline
        return
    from validate.metrics.baselines import nearer_baseline
    from validate.metrics.verdict import NEARLY_ALL, use_of_readings
    from validate.units import percent

    interval = stations = mean_level = ""
    if m.uncertainty is not None:
        interval, stations, mean_level = _uncertain(m.uncertainty)
    covered = f" The readings cover {percent(m.coverage, 0)} of the crack." if m.coverage < NEARLY_ALL else ""
    yield f"mean error {m.mean_error_mm:.2f} mm{interval}.{covered} {use_of_readings(m, in_full=False)}"
    yield f"{nearer_baseline(m.mean_error_mm, m.baselines)}{stations}"
    worst = f"Worst {m.worst_error_mm:.1f} mm at s = {round(m.worst_at_mm, 1):g} mm"
    if (station := m.worst_at_a_station) is not None:
        worst += f", between readings; {station.error_mm:.1f} mm at a station"
    yield f"{worst}.{mean_level}"


def _uncertain(uncertainty: "ErrorUncertainty") -> tuple[str, str, str]:
    """Return the interval of the mean error, and sentences on the stations and on the mean level, if it was assessed.

    A station counts if its error is outside the 95 % band of all stations together.
    """
    from validate.uncertainty.validation import COVERAGE
    from validate.units import signed

    low_mm, high_mm = uncertainty.mean_error_interval_mm
    unknown = "" if uncertainty.budget.scatter_known else ", scatter of the readings unknown"
    interval = f" (95 %: {low_mm:.2f} to {high_mm:.2f}{unknown})"
    mean, off = uncertainty.mean_level, uncertainty.stations.off
    computed = {"numerics": mean.numerics_mm, "inputs": mean.inputs_mm}
    *first, last = ["readings", *(name for name, value_mm in computed.items() if value_mm is not None)]
    errors = f"the errors of {', '.join(first)} and {last}" if first else "the readings' own error"
    side = "Beyond" if off.any() else "Within"
    stations = f" {side} {errors} at {int(off.sum()) or 'all'} of {len(off)} stations."
    if mean.resolved is None:
        return interval, stations, ""
    band = f"{signed(mean.error_mm, 2)} ± {COVERAGE * mean.validation_mm:.2f} mm"
    return interval, stations, f" Mean level off by {band} (95 %, ASME V&V 20)."


def _gate(m: "Comparison") -> str:
    if m.gate is None:
        # A gate is not applied to a level by the fast model.
        return m.headline[0] if len(m.headline) > HEADLINE else "none declared"
    low_mm, high_mm = m.interval_95_mm or (m.mean_error_mm, m.mean_error_mm)
    inside = m.outcome == "undecided" and low_mm <= m.gate.mean_error_mm <= high_mm
    return f"{m.gate.mean_error_mm:g} mm: {m.outcome}{', since it is inside the 95 % interval' if inside else ''}"


def _without_readings(prediction: "PredictedLevel | None") -> str:
    if prediction is None:
        return "No readings: the simulated fill is not compared with anything."
    import numpy as np

    from validate.wording.prediction import predicted_sentence

    band_mm = float(np.median(prediction.band_95_mm))
    return f"{predicted_sentence(prediction)} The level at a place: ± {band_mm:.2f} mm (95 %, median)."


def _hint(result: "TrialResult", extra_runs: str) -> str:
    """Return what 'sealtwin validate RUN --uncertainty' would add; empty if nothing, or if its time is unknown."""
    if (m := result.comparison) is None:
        adds = "a 95 % band" if result.prediction is None else ""
    else:
        mean = None if m.uncertainty is None or len(m.headline) != HEADLINE else m.uncertainty.mean_level
        adds = "model errors" if mean is not None and (mean.numerics_mm is None or mean.inputs_waiting) else ""
    return f" (validate --uncertainty adds {adds}, about {extra_runs})" if adds and extra_runs else ""


def _details(result: "TrialResult", last: "StageName", *, compared: bool) -> Iterator[str]:
    """Yield sentences with the figures that the other lines leave out."""
    if (sample := result.sample) is not None:
        yield f"Path of the crack: {sample.path_source}."
        scale = [*_scale(sample)]
        if sample.scale_residual_mm is not None:
            scale.append(f"residual {sample.scale_residual_mm:.3f} mm")
        if sample.camera_tilt_deg is not None:
            scale.append(f"camera tilted {sample.camera_tilt_deg:.1f} degrees")
        yield f"Scale: {', '.join(scale)}."
    if (fluid := result.fluid) is not None and last != "digitise":
        particles = "" if fluid.particles is None else f"{fluid.particles:,} particles; "
        yield f"Fluid: {particles}volume ratio {fluid.volume_ratio:.3f}; {fluid.device}."
    if not compared:
        return
    if (m := result.comparison) is not None:
        unused = () if m.uncertainty is None else m.uncertainty.unused
        yield from m.headline if len(m.headline) >= HEADLINE else ()
        yield from _extra_runs(m.uncertainty) if m.uncertainty is not None else ()
        yield from (sentence for sentence in m.findings if sentence not in unused)
        yield f"Readings: {m.readings_dialect}."
    if result.prediction is not None:
        from validate.wording.prediction import prediction_sentences

        yield from prediction_sentences(result.prediction)


def _extra_runs(uncertainty: "ErrorUncertainty") -> Iterator[str]:
    """Yield the results of the extra runs of --uncertainty, if there are any."""
    from validate.units import MODELS
    from validate.wording.prediction import INPUTS

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
