"""Run stages for a command, and print the result as text or as the content of run.json."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sealtwin.cli.answer import GATE_FAILED, Command
from sealtwin.core.facts import of_keys, texts, without

if TYPE_CHECKING:
    from sealtwin.core.facts import Fact
    from sealtwin.study.pipeline import FinishedStages
    from sealtwin.trial.job import StageName
    from validate.result import TrialResult

Rows = Iterator[tuple[str, str]]  # Pairs of a label and a text. A label that repeats the previous label is not printed
LABEL_LETTERS = 9  # Width of the column of labels, in characters
MIN_MM3 = 200.0  # Smallest volume above the face that is printed


def run_file(
    command: Command,
    file: Path,
    out: Path | None,
    stages: "Sequence[StageName]",
    settings: Mapping[str, Any] | None = None,
    *,
    threads: int | None = None,
) -> None:
    """Run stages of a trial file, or begin a trial from a photo, a mesh or a drawing, and print the result.

    ``settings`` by dotted name replace values of the file.
    """
    from sealtwin.core.workers import cores
    from sealtwin.study import pipeline
    from sealtwin.trial.job import TRIAL, TRIAL_SUFFIX
    from sealtwin.trial.starter_files import begin_trial
    from sealtwin.trial.trial_file import load_trial

    begins = file.suffix.lower() != TRIAL_SUFFIX
    trial = begin_trial(file, settings or {}) if begins else load_trial(file, settings)
    with command.progress() as progress:
        done = pipeline.run_trial(trial, file, out, stages, command.device, progress, threads, cores())
    # The trial in the run folder has the settings of the command line.
    again = Path(done.result.folder, TRIAL) if begins or settings or out else file
    _reply(command, done, stages, progress.warned, again)


def resume(
    command: Command,
    path: Path,
    stage: "StageName",
    settings: Mapping[str, Any],
    *,
    threads: int | None = None,
    uncertainty: bool = False,
) -> None:
    """Run one stage of a trial file or of a run folder's trial, and print the result.

    ``settings`` by dotted name replace values of the trial, and are written to RUN/trial.toml. With ``uncertainty``,
    the extra runs are computed first.
    """
    from sealtwin.core.run_folder import open_folder
    from sealtwin.core.workers import cores
    from sealtwin.study.pipeline import run_stages
    from sealtwin.study.uncertainty_runs import vary
    from sealtwin.trial.job import TRIAL, existing_run, start_job
    from sealtwin.trial.trial_file import load_trial

    file = path / TRIAL if path.is_dir() else path
    with open_folder(existing_run(path), create=False) as folder, command.progress() as progress:
        job = start_job(load_trial(file, settings), file.parent, folder, command.device, progress, file)
        job = replace(job, jobs=cores(), threads=threads)
        if uncertainty:
            vary(job)
        done = run_stages(job, (stage,))
    _reply(command, done, (stage,), progress.warned, file)


def _reply(
    command: Command,
    done: "FinishedStages",
    stages: "Sequence[StageName]",
    printed: "Sequence[Fact]",
    file: Path,
) -> None:
    from validate.sentences import sentence

    result = done.result
    missed = "validate" in stages and result.comparison is not None and result.comparison.passed is False
    lines = result_lines(result, stages[-1], printed, can_be_varied=done.can_be_varied)
    if "validate" in stages and result.comparison is None and done.can_be_planned:
        text = sentence("terminal_next", file=file.as_posix(), assumed=result.assumed)
        lines.append(f"{'Next':<{LABEL_LETTERS}}{text}")
    command.reply(result.model_dump(mode="json"), lines, GATE_FAILED if missed else 0)


def result_lines(
    result: "TrialResult",
    last: "StageName",
    printed: "Sequence[Fact]" = (),
    *,
    can_be_varied: bool = False,
) -> list[str]:
    """Return the printed lines for a result, after a command whose last stage was ``last``.

    Args:
        result: Result of the trial.
        last: Last stage of the command.
        printed: Facts that the command has printed. These are not repeated.
        can_be_varied: True if 'sealtwin validate RUN --uncertainty' can add to the result. The lines then suggest it.
    """
    from validate.sentences import sentence

    compared = last == "validate" and result.report is not None
    rows = [
        *_made(result, last),
        *([("Assumed", ", ".join(result.assumed))] if result.assumed else []),
        *(("Warning", f"{fact}") for fact in _warnings(result, last) if fact not in printed),
        *(_concluded(result) if compared else ()),
    ]
    report = sentence("terminal_report", result=result, adds=_adds(result) if can_be_varied else "")
    rows.append(("Report", report) if compared else ("Folder", result.folder))
    return [
        f"{label if number == 0 else '':<{LABEL_LETTERS}}{text}"
        for label, group in groupby(rows, key=lambda row: row[0])
        for number, (_, text) in enumerate(group)
    ]


def _made(result: "TrialResult", last: "StageName") -> Rows:
    """Yield rows about the sample, and about the fluid if ``last`` is a stage after digitising."""
    from validate.run_facts import mean_sentence
    from validate.sentences import sentence

    sample, fluid = result.sample, None if last == "digitise" else result.fluid
    if sample is not None:
        source = (
            "line found without clicks, perhaps a part of the crack, see overlay.png: "
            if sample.path_source == "found"
            else ""
        )
        yield "Crack", source + sentence("terminal_crack", sample=sample, poured=fluid is not None)
        if sample.weighed is not None:
            yield "Cavity", sentence("terminal_cavity", sample=sample)
        if last == "digitise":
            yield "Scale", sentence("terminal_scale", sample=sample)
    if fluid is not None:
        yield "Fluid", sentence("terminal_fluid", fluid=fluid, least_mm3=MIN_MM3)
        yield from (("Fluid", text) for text in texts(fluid.unfit or ()))
        if result.seeds is not None:
            yield "Seeds", mean_sentence(result.seeds)


def _warnings(result: "TrialResult", last: "StageName") -> "Iterator[Fact | str]":
    """Yield the reasons why the result may be wrong."""
    from validate.sentences import sentence

    yield from result.other_versions
    if (sample := result.sample) is not None:
        yield from sample.warnings
    if (fluid := result.fluid) is not None and last != "digitise":
        # The rows about the fluid already contain these facts.
        yield from without(fluid.warnings, "method.fast", "unfit")
    if last == "validate" and result.comparison is None and result.edited:
        yield sentence("files.edited", edited=result.edited)


def _concluded(result: "TrialResult") -> Rows:
    """Yield rows about the comparison or the prediction."""
    from validate.report.report_facts import predicted, prediction_facts
    from validate.sentences import sentence

    if (m := result.comparison) is not None:
        yield from (("Result", text) for text in texts(m.headline))
        if of_keys(m.headline, "verdict.baselines"):
            yield "Result", sentence("terminal_worst", m=m)
            # Those about the mean level, if it is assessed, and about the stations
            findings = m.uncertainty.findings[:2] if m.uncertainty else ()
            yield from (("Result", fact.text) for fact in findings if fact.value is not None)
        return
    yield "Result", predicted(result.prediction).text
    if result.prediction is not None:
        yield "Result", prediction_facts(result.prediction)[0].text


def _adds(result: "TrialResult") -> str:
    """Return what 'sealtwin validate RUN --uncertainty' would add to the result, or ""."""
    if (m := result.comparison) is None:
        return "a 95 % band" if result.prediction is None else ""
    judged = of_keys(m.headline, "verdict.gate")
    mean = None if m.uncertainty is None or not judged else m.uncertainty.mean_level
    return "model errors" if mean is not None and (mean.numerics_mm is None or mean.inputs_waiting) else ""
