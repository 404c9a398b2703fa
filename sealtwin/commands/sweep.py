"""One trial many times, each time with other settings; and how far that is."""

from pathlib import Path
from typing import Annotated

import typer

from sealtwin.answering import Device, Json, Quiet, answering

STATUS = "status"
LAUNCH = 256
"""Runs of the paper's size in one launch on a GPU: 2 GB of its memory, 6 where nothing freezes."""


def sweep(
    targets: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="STUDY | status DIR",
            help="A study.toml; or 'status' and the folder of a sweep, also while it runs.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="The sweep's folder; default: reports/<study name>.")
    ] = None,
    device: Device = "auto",
    jobs: Annotated[
        int | None, typer.Option(min=1, max=512, help="Processes; default: one for each core, one on a GPU.")
    ] = None,
    batch: Annotated[
        int | None,
        typer.Option(
            min=1, max=4096, help=f"Runs in one launch that differ in the fluid alone; default: 1, {LAUNCH} on a GPU."
        ),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option("--dask", metavar="tcp://HOST:PORT", help="Run on the workers of this Dask scheduler instead."),
    ] = None,
    keep_runs: Annotated[bool, typer.Option("--keep-runs", help="Keep the particles of each run too.")] = False,
    retry: Annotated[bool, typer.Option("--retry", help="Compute runs once more that failed.")] = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check all settings, digitise, estimate; inject nothing.")
    ] = False,
    example: Annotated[
        Path | None, typer.Option("--example", metavar="FILE", help="Write a commented study file to start from.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run a trial many times with other settings: a grid, a list or a Latin hypercube, on all cores.

    What is done is kept: killed or interrupted, the same command goes on. A failed run is named, with its reason.

    Examples: sealtwin sweep fixtures/paper-trial/study-paper.toml --dry-run

    sealtwin sweep status reports/paper-132
    """
    with answering(device, as_json, quiet) as command:
        if example is not None:
            if targets:
                raise typer.BadParameter("--example beside a study: it only writes a study file to start from")
            from sealtwin.study.study_example import write_example_study

            write_example_study(example)
            command.answer({"version": 1, "file": example.as_posix()}, [str(example)])
            return
        if not targets:
            raise typer.BadParameter("give a study; --example FILE writes one to start from")
        if str(targets[0]) == STATUS:
            if len(targets) != 2:
                raise typer.BadParameter("status: give the folder of one sweep")
            from sealtwin.study.sweep import status

            report = status(targets[1])
            command.answer(report.content, report.lines)
            return
        if len(targets) != 1:
            raise typer.BadParameter(f"{len(targets)} studies: give one")
        from sealtwin.study.sweep import Wish, cores
        from sealtwin.study.sweep import sweep as sweep_study
        from simulate.device import choose_device, describe_device

        chosen = choose_device(device)
        command.say(f"Device: {describe_device(chosen)}")
        on_cpu = chosen == "cpu"
        wish = Wish(
            device=chosen,
            jobs=jobs or (cores() if on_cpu else 1),
            batch=batch or (1 if on_cpu else LAUNCH),
            keep_runs=keep_runs,
            retry=retry,
            dry_run=dry_run,
            dask=dask,
        )
        report = sweep_study(targets[0], out, wish, command.progress())
        command.answer(report.content, report.lines)
        if report.exit_code:
            raise typer.Exit(report.exit_code)
