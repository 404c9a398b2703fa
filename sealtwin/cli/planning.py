"""Commands that plan the fill of a crack, and correct it on the way."""

from pathlib import Path
from typing import Annotated

import typer

from sealtwin.cli.answer import Answer, Command, answers
from sealtwin.cli.options import File, Given, Number, argument, count_option, flag, number_option, option
from sealtwin.core.errors import present


@answers(device=True)
def plan(
    command: Command,
    trial: Annotated[Path, argument("TRIAL", "A trial.toml with a path and a sealant that does not age.")],
    settings: Given,
    out: Annotated[File, option("The plan's folder; default: reports/<trial name>-plan.", "DIR")] = None,
    cell: Annotated[File, option("The robot's cell file: its limits and its pump's bound the plan.", "FILE")] = None,
    posterior: Annotated[
        File, option("Draws of the sealant: a CSV with a header of settings, as fluid.yield_stress_pa.", "CSV")
    ] = None,
    flow_max_mm3_s: Annotated[Number, number_option("Largest flow, where no cell says it.", 0.01, 1e6)] = None,
    margin_mm: Annotated[float, number_option("Level below the face to aim at.", 0, 100)] = 0.0,
    knots: Annotated[int, count_option("Places along the path where flow and speed are free.", 3, 40)] = 8,
    verify: Annotated[int, count_option("Rounds of search and particles.", 1, 10)] = 3,
    seeds: Annotated[int, count_option("Particle runs of the plan that is kept; its band needs two.", 1, 20)] = 3,
    keep_speed: Annotated[bool, flag("--keep-speed", "Plan the flow alone, at the trial's speed.")] = False,
    jobs: Annotated[int, count_option("Processes for particle runs that can be made at once.", 1, 512)] = 1,
) -> None:
    """Plan flow and speed along a crack, so that it is full and nothing overspills.

    Searched on the fast model, judged by particles, and searched again with the difference. The same command goes on
    after a kill.

    Example: sealtwin plan trial.toml --cell cell.toml
    """
    from sealtwin.plan.make_plan import Options, make_plan
    from simulate.device import choose_device

    options = Options(knots, verify, seeds, margin_mm, flow_max_mm3_s, keep_speed)
    made = make_plan(
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
    files = f"Plan: {made.content['folder']}/plan.csv, and trial.toml that runs it. Page: plan.html"
    command.reply(Answer(made.content, [*made.sentences, files]))


@answers()
def loop(
    command: Command,
    folder: Annotated[Path, argument("PLAN", "The folder of a finished plan.")],
    emulate: Annotated[
        File, option("Pour by particles with these faults, corrected on the way.", "faults.toml")
    ] = None,
    replay: Annotated[File, option("Answer the steps of a log again, and compare.", "LOG")] = None,
    seed: Annotated[int, count_option("Seed of particles and sensor.", 0, 2**31 - 1)] = 1,
    uncorrected: Annotated[bool, flag("--uncorrected", "Pour the plan as it is, to compare.")] = False,
) -> None:
    """Correct a plan's flow on the way from the level so far, with a top-up pass; emulated, or replayed from a log.

    A controller calls the pure function sealtwin.loop_step itself. The first call makes the tables.

    Example: sealtwin loop reports/crack-plan --emulate faults.toml
    """
    from sealtwin.plan import make_loop
    from sealtwin.plan.pages import loop_finding

    if (emulate is None) == (replay is None):
        raise typer.BadParameter("give either --emulate faults.toml or --replay LOG")
    if replay is not None:
        steps, others = make_loop.replay(folder, replay), make_loop.loop_versions(folder)
        answer = {"version": 1, "log": replay.as_posix(), "steps": steps, "other_versions": others}
        command.reply(Answer(answer, [*others, f"{steps} steps, all answered alike."]))
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
