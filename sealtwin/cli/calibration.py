"""Command that calibrates settings by the readings of one trial or several, and predicts others."""

from datetime import date as day
from pathlib import Path
from typing import Annotated, Any

import typer

from sealtwin.cli.answer import GATE_FAILED, Answer, Command, answers
from sealtwin.cli.material import day_of
from sealtwin.cli.options import File, Given, Text, argument, count_option, option, read_number

LEAST_BUDGET = 40  # That of sealtwin.calibration; --help must not load it


@answers(device=True)
def calibrate(
    command: Command,
    trials: Annotated[list[Path], argument("TRIAL ...", 'Trial files whose readings have the role "calibrated-on".')],
    free: Annotated[
        list[str],
        option(
            "A setting that is not known, with its range; give one for each, up to 6. One that was measured has its "
            "value and uncertainty from the trial beforehand, any other is equally likely in its range.",
            "SETTING=LOW:HIGH",
        ),
    ],
    settings: Given,
    hold_out: Annotated[
        list[Path] | None, option('A trial that is predicted and judged: role "held-out"; can be repeated.', "TRIAL")
    ] = None,
    budget: Annotated[
        int, count_option("Runs of each trial. Fewer give intervals that hold too few truths.", LEAST_BUDGET, 400)
    ] = LEAST_BUDGET,
    out: Annotated[File, option("The folder; default: reports/<trial name>-calibrated.", "DIR")] = None,
    date: Annotated[Text, option("Day of the calibration; default: today.", "YYYY-MM-DD")] = None,
    jobs: Annotated[int | None, count_option("Processes; default: one for each core, one on a GPU.", 1, 512)] = None,
) -> None:
    """Find settings by the readings of trials: a posterior, what it determines, and a prediction of other trials.

    Runs that are made are kept: killed or interrupted, the same command goes on, and gives the same files. Exit code 5:
    no setting of the ranges makes the readings, which the page states.

    Example: sealtwin calibrate trial.toml --free fluid.yield_stress_pa=3:60 --free fluid.viscosity_pa_s=0.2:5
    --hold-out other.toml
    """
    from sealtwin.calibration.calibrate import calibrate as find
    from sealtwin.core.cluster import cores
    from sealtwin.lab.held_out import facts_above, note_use
    from sealtwin.study.sweep import SweepOptions
    from sealtwin.trial.trial_file import load_trial
    from simulate.device import choose_device, describe_device

    ranges = _ranges(free)
    if twice := sorted(ranges.keys() & settings.keys()):
        raise typer.BadParameter(f"--set {twice[0]} beside --free, which finds it; give one")
    for file in hold_out or []:
        facts_above(load_trial(file, settings), file.parent)
    chosen = choose_device(command.device)
    command.say(f"Device: {describe_device(chosen)}")
    count = jobs or (cores() if chosen == "cpu" else 1)
    # A process of its own costs seconds, once for each round.
    how = SweepOptions(device=chosen, jobs=0 if count == 1 else count)
    when = day.today() if date is None else day_of(date)
    done = find(
        trials,
        ranges,
        out,
        how,
        command.progress(),
        held_out=hold_out or [],
        budget=budget,
        date=when,
        settings=settings,
    )
    for twin in done.calibrated:
        note_use(twin.sheet, twin.readings, f"calibration of '{done.content['name']}'")
    command.reply(Answer(done.content, _lines(done.content), 0 if done.content["possible"] else GATE_FAILED))


def _ranges(given: list[str]) -> dict[str, tuple[float, float]]:
    """Read SETTING=LOW:HIGH. Raises typer.BadParameter."""
    ranges: dict[str, tuple[float, float]] = {}
    for text in given:
        name, _, ends = text.partition("=")
        low, colon, high = ends.partition(":")
        try:
            if not (name and colon):
                raise ValueError("expected SETTING=LOW:HIGH, as fluid.yield_stress_pa=3:60")
            found = read_number(low, comma=False), read_number(high, comma=False)
        except ValueError as fault:
            raise typer.BadParameter(f"--free {text:.80}: {fault}") from None
        if name in ranges:
            raise typer.BadParameter(f"--free {name}: given twice")
        ranges[name] = found
    return ranges


def _lines(content: dict[str, Any]) -> list[str]:
    return [
        *content["cautions"],
        f"{content['name']}: {content['runs_of_each_trial']} runs of each trial.",
        content["finding"],
        *content["advice"],
        f"Page: {content['page']}",
    ]
