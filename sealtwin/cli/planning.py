"""Commands that plan the fill of a crack, and correct it during the pour."""

from pathlib import Path
from typing import Annotated

import typer

from sealtwin.cli.answer import Answer, Command, answers
from sealtwin.cli.options import Accurate, File, Given, Number, argument, count_option, flag, number_option, option
from sealtwin.core.errors import present


@answers(device=True)
def plan(
    command: Command,
    trial: Annotated[
        Path, argument("TRIAL", "A trial.toml with a path and with a sealant whose properties do not change with age.")
    ],
    settings: Given,
    out: Annotated[File, option("The plan's folder; default: reports/<trial name>-plan.", "DIR")] = None,
    cell: Annotated[
        File, option("The robot's cell file; the plan keeps within its limits and those of its pump.", "FILE")
    ] = None,
    posterior: Annotated[
        File, option("Draws of the sealant: a CSV whose header names settings, such as fluid.yield_stress_pa.", "CSV")
    ] = None,
    flow_max_mm3_s: Annotated[Number, number_option("Largest flow, if no cell sets it.", 0.01, 1e6)] = None,
    margin_mm: Annotated[float, number_option("Level to aim at, as a distance below the face.", 0, 100)] = 0.0,
    reserve_mm: Annotated[
        Number,
        number_option(
            "Extra distance below the face, in case the pump gives more or the paste is softer; default: 0.25.", 0, 100
        ),
    ] = None,
    knots: Annotated[int, count_option("Places along the path at which flow and speed are chosen.", 3, 40)] = 8,
    verify: Annotated[int, count_option("Rounds of search and particle run.", 1, 10)] = 3,
    seeds: Annotated[int, count_option("Particle runs of the best plan; its 95 % band needs at least two.", 1, 20)] = 3,
    keep_speed: Annotated[bool, flag("--keep-speed", "Plan only the flow, at the trial's speed.")] = False,
    jobs: Annotated[int, count_option("Processes for particle runs.", 1, 512)] = 1,
    accurate: Accurate = False,
) -> None:
    """Plan flow and speed along a crack, so that it is full and nothing overspills.

    Searches with the fast model, checks the plan with particles, corrects the fast model by the difference, and
    searches again. The runs are drafts, as those of a sweep, except the last two, which correct the plan and give its
    level. After an interruption, repeat the command to continue.

    Example: sealtwin plan trial.toml --cell cell.toml
    """
    from sealtwin.plan.make_plan import RESERVE_MM, Options, make_plan
    from sealtwin.trial.draft import sets_resolution
    from simulate.device import choose_device

    drafts = not (accurate or sets_resolution(settings))
    reserve = RESERVE_MM if reserve_mm is None else reserve_mm
    options = Options(knots, verify, seeds, drafts, margin_mm, flow_max_mm3_s, keep_speed, reserve)
    result = make_plan(
        trial,
        out,
        options,
        command.progress(),
        device=choose_device(command.device),
        jobs=jobs,
        cell_file=cell,
        posterior=posterior,
        settings=settings,
    )
    files = f"Plan: {result.content['folder']}/plan.csv, and trial.toml to run it. Page: plan.html"
    command.reply(Answer(result.content, [*result.sentences, files]))


@answers()
def loop(
    command: Command,
    folder: Annotated[Path, argument("PLAN", "The folder of a finished plan.")],
    emulate: Annotated[
        File, option("Simulate the corrected pour with particles and with the faults in this file.", "faults.toml")
    ] = None,
    replay: Annotated[File, option("Compute the steps of a log again, and compare.", "LOG")] = None,
    seed: Annotated[int, count_option("Seed of the particles and the sensor.", 0, 2**31 - 1)] = 1,
    uncorrected: Annotated[bool, flag("--uncorrected", "Pour the plan without corrections, to compare.")] = False,
) -> None:
    """Correct a plan's flow during the pour according to the measured level, with a top-up pass.

    The command emulates such a pour, or replays a log. A controller calls the function sealtwin.loop_step. The first
    call computes its tables.

    Example: sealtwin loop reports/crack-plan --emulate faults.toml
    """
    from sealtwin.plan import make_loop
    from sealtwin.plan.pages import loop_finding

    if (emulate is None) == (replay is None):
        raise typer.BadParameter("give either --emulate faults.toml or --replay LOG")
    if replay is not None:
        steps, others = make_loop.replay(folder, replay), make_loop.loop_versions(folder)
        answer = {"version": 1, "log": replay.as_posix(), "steps": steps, "other_versions": others}
        command.reply(Answer(answer, [*others, f"{steps} steps, all reproduced."]))
        return
    faults = present(emulate, "--emulate")
    content = make_loop.run_loop(folder, faults, command.progress(), seed=seed, corrects=not uncorrected)
    stopped = [f"The pour stopped: {content['stopped']}"] if content["stopped"] else []
    files = f"Log: {content['folder']}/{content['log']}. Page: loop.html"
    command.reply(
        Answer(
            content,
            [*content["other_versions"], *content["fluid_warnings"], *stopped, loop_finding(content), files],
        )
    )
