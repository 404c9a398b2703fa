"""One trial through the stages, each redone only where its inputs, settings or this version changed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sealtwin.errors import NumericalError
from sealtwin.trials import digitising, simulating, validating
from sealtwin.trials.job import STAGES, Job, StageName, adopt_trial
from sealtwin.trials.result import read_result


@dataclass(frozen=True)
class Outcome:
    """What a command says at its end."""

    result: dict[str, Any]
    """The --json object, and run.json."""
    redone: tuple[StageName, ...]
    gate_passed: bool | None


def run_stages(job: Job, stages: Sequence[StageName]) -> Outcome:
    """Bring ``stages`` up to date, in their order.

    A stage that fails leaves the folder as it was, but for refused.png and the checkpoint of a fluid run.

    Raises:
        InputError, NumericalError: from a stage; or since a particle escaped, with all files written.
    """
    work = {"digitise": digitising, "simulate": simulating, "validate": validating}
    redone: list[StageName] = []
    for stage in STAGES:
        if stage == "simulate" and "simulate" in stages and "validate" in stages:
            # Minutes of simulation must not pass before a typo in the sheet is found.
            validating.readings_of(job)
        if stage in stages and work[stage].bring_up_to_date(job):
            redone.append(stage)
    adopt_trial(job)
    result = read_result(job.folder, job.trial)
    if (escaped := result.get("escaped_particles")) and stages[-1] != "digitise":
        raise NumericalError(
            f"{job.path}: {escaped} particles went through a wall, which must never happen; the files are complete, "
            "but do not use them. Please report this with the trial file."
        )
    if not redone:
        job.progress.note(f"{job.path}: complete and up to date; nothing to redo.")
    return Outcome(result, tuple(redone), result.get("gate_passed"))
