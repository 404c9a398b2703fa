"""The command that plans the fill of a crack, or the rest of it."""

from pathlib import Path
from typing import Annotated

import typer

from sealtwin.cli.answer import Answer, Command, answers
from sealtwin.cli.options import Accurate, File, Given, Number, argument, count_option, flag, number_option, option


@answers(device=True)
def plan(
    command: Command,
    trial: Annotated[
        Path, argument("TRIAL", "A trial.toml with a path and with a sealant whose properties do not change with age.")
    ],
    settings: Given,
    levels: Annotated[
        File,
        option(
            "Plan the rest of a paused pour of TRIAL, by the fast model alone, from measured levels: a CSV of s_mm and "
            "level_mm (negative below the face), from the beginning of the pour up to the nozzle.",
            "CSV",
            "--from",
        ),
    ] = None,
    out: Annotated[
        File, option("The plan's folder; default: reports/<trial name>-plan, or -rest with --from.", "DIR")
    ] = None,
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
            "Extra distance below the face, in case the pump gives more or the paste is softer; default: 0.25. With 0, "
            "corrections by particles may also add sealant.",
            0,
            100,
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

    With --from, the path of TRIAL is the one that is poured, mostly that of a plan.

    Example: sealtwin plan reports/crack-plan/trial.toml --from levels.csv
    """
    from sealtwin.plan.make_plan import RESERVE_MM, Options, make_plan
    from sealtwin.plan.rest import plan_rest
    from sealtwin.trial.trial_file import sets_resolution
    from simulate.device import choose_device

    drafts = not (accurate or sets_resolution(settings))
    reserve = RESERVE_MM if reserve_mm is None else reserve_mm
    options = Options(knots, verify, seeds, drafts, margin_mm, flow_max_mm3_s, keep_speed, reserve)
    if levels is not None:
        if posterior is not None or (verify, seeds, jobs, accurate) != (3, 3, 1, False):
            raise typer.BadParameter("--from takes no --posterior, --verify, --seeds, --jobs or --accurate")
        result = plan_rest(trial, levels, out, options, command.progress(), cell_file=cell, settings=settings)
        command.reply(Answer(result.content, [*result.sentences, f"Path: {result.content['folder']}/rest.csv"]))
        return
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
