"""Commands that start a trial, run it or one of its stages, and write its robot programs."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sealtwin.cli.answer import Command, answers
from sealtwin.cli.options import FLUID, SAMPLE, File, Given, Out, argument, flag, option
from sealtwin.cli.trial_answer import resume, run_file

if TYPE_CHECKING:
    from digitise.robots.cell import ProgramOptions
    from sealtwin.cli.models import FluidRun
    from sealtwin.trial.job import StageName

ALL_STAGES: "tuple[StageName, ...]" = ("digitise", "simulate", "validate")
TrialFile = Annotated[Path, argument("TRIAL", "A trial.toml; 'sealtwin init DIR' writes one.")]
RunFolderPath = Annotated[
    Path, argument("RUN|TRIAL", "A run folder, or a trial.toml that was run in its default folder.")
]
FLUID_RUN = "sealtwin.cli.models:FluidRun"


@answers(options="digitise.robots.cell:ProgramOptions")
def robot(
    command: Command,
    folder: Annotated[File, argument("RUN|TRIAL", "A digitised run folder, or its trial.toml.")] = None,
    cell: Annotated[File, option("Cell file of the robot: taught points, limits, languages.", "FILE")] = None,
    *,
    options: "ProgramOptions",
    out: Annotated[File, option("Folder for the files. Default: robot/ in the run folder.", "DIR")] = None,
    example: Annotated[File, option("Write an example of a cell file, with comments.", "FILE")] = None,
) -> None:
    """Write a run's nozzle path as tables and programs for a robot.

    Example: sealtwin robot reports/paper-trial --cell cell.toml --format spel
    """
    if example is not None:
        from sealtwin.trial.starter_files import write_example_cell

        command.write_example(example, folder or cell, write_example_cell)
        return
    if folder is None or cell is None:
        raise typer.BadParameter("give RUN and --cell FILE; --example FILE writes an example of a cell file")
    from sealtwin.core.run_folder import open_folder
    from sealtwin.trial.exports import REPORT, write_robot_files
    from sealtwin.trial.job import existing_run

    with open_folder(existing_run(folder), create=False) as run:
        report = write_robot_files(run, cell, options, out)
    for name in report["kept"]:
        command.warn(f"a robot file was edited after it was written; your version is kept as {name}.")
    for warning in report["warnings"]:
        command.warn(warning)
    frame = report["frame"]
    lines = [
        *report["other_versions"],
        f"Path: {report['length_mm']:.1f} mm in {report['duration_s']:.1f} s, "
        f"{report['sealant_mm3'] / 1000:.3g} ml; "
        f"the largest residual of {frame['taught_points']} taught points is {frame['worst_residual_mm']:.2f} mm, "
        f"and the face is tilted by {frame['tilt_deg']:.1f} degrees.",
        *_pump_line(report.get("pump")),
        f"Robot files: {', '.join([*report['files'], REPORT])} in {report['folder']}",
    ]
    command.reply(report, lines)


def _pump_line(pump: dict[str, Any] | None) -> list[str]:
    if pump is None:
        return []
    requested, wanted = (
        " to ".join(dict.fromkeys(f"{flow:.4g}" for flow in pump[f"{name}_mm3_s"])) for name in ("asked", "wanted")
    )
    waits = f". It waits {pump['waits_s']:.2g} s at the start" if pump["waits_s"] else ""
    half_percent = pump["interval_95_percent"]
    within = (
        "no interval, since all weighings are equal"
        if half_percent is None
        else f"95 % interval ± {half_percent:.2g} %"
    )
    return [f"Pump: the program requests {requested} mm³/s, so that the pump gives {wanted} mm³/s ({within}){waits}."]


@answers(*SAMPLE, *FLUID, "readings.file", device=True)
def quick(
    command: Command,
    target: Annotated[Path, argument("FILE", "Photo from above, mesh (STL, PLY, GLB) or drawing (DXF) of the crack.")],
    settings: Given,
    out: Out = None,
) -> None:
    """Make a mesh, a path, a fluid run and a report from a photo and a depth. The run is a draft.

    Settings that you do not give are assumed, and listed in the answer, in the report and in RUN/trial.toml. Correct
    them there, and continue with 'sealtwin run RUN/trial.toml'. The walls are assumed to lean, since a photo does not
    show their angle. To measure the angle, weigh a liquid into the crack (crack.fill).

    Example: sealtwin quick photo.jpg --depth-mm 16 --mm-per-px 0.1 --ends 12,340 905,377 --caliper caliper.csv
    """
    run_file(command, target, out, ALL_STAGES, {"solver.preset": "draft", **settings})


@answers(device=True)
def demo(
    command: Command,
    out: Annotated[File, option("Folder for trial/ and run/. Default: reports/demo.", "DIR")] = None,
    real: Annotated[
        bool,
        flag(
            "--real",
            "Run the fast model for a photo of a real crack instead. The scale of the photo, the depth, the walls and "
            "the sealant are invented.",
        ),
    ] = False,
) -> None:
    """Run the reconstruction of the paper's trial: copy its photo, readings and trial, and run all stages."""
    from sealtwin.trial.starter_files import PAPER, REAL, place_trial

    folder = out or Path("reports", REAL if real else "demo")
    trial = folder / "trial" / "trial.toml"
    place_trial(trial.parent, REAL if real else PAPER)
    command.say(f"Trial file: {trial}")
    run_file(command, trial, folder / "run", ALL_STAGES)
    if real:
        draft = f"--set solver.model=particles --preset draft --out {folder / 'draft'}"
        command.say(f"With particles, as a draft: sealtwin run {folder / 'run' / 'trial.toml'} {draft}")


@answers(*FLUID, options=FLUID_RUN, device=True)
def run(command: Command, trial: TrialFile, settings: Given, options: "FluidRun", out: Out = None) -> None:
    """Run all stages of a trial that are not up to date: digitise, simulate, validate and report.

    During the fluid run, a checkpoint is written every ten seconds. If the process is killed, repeat the command to
    continue. The table output of the trial sets snapshots, frames and the PDF.
    """
    run_file(command, trial, out, ALL_STAGES, settings, threads=options.threads)


@answers(*FLUID, options=FLUID_RUN, device=True)
def simulate(command: Command, folder: RunFolderPath, settings: Given, options: "FluidRun") -> None:
    """Compute the fluid run of a digitised run folder, with the settings in RUN/trial.toml."""
    resume(command, folder, "simulate", settings, threads=options.threads)


@answers(device=True)
def validate(
    command: Command,
    folder: RunFolderPath,
    settings: Given,
    uncertainty: Annotated[
        bool,
        flag(
            "--uncertainty",
            "First compute extra runs, stored in RUN/uncertainty: three runs each with finer, equal and coarser "
            "particles, and runs in which each input in the table uncertainty is changed by its declared uncertainty. "
            "The key differences of that table sets the model of these runs. They take 10 to 15 times the computing "
            "time of RUN, on all cores. Without readings, the level is a prediction with a 95 % band.",
        ),
    ] = False,
) -> None:
    """Compare a simulated run folder with its readings, if there are any, and write the report."""
    resume(command, folder, "validate", settings, uncertainty=uncertainty)


@answers()
def init(command: Command, folder: Annotated[Path, argument("DIR", "Folder for the new trial.")]) -> None:
    """Write an example of a trial, with comments, and an empty sheet for readings (XLSX).

    Settings that nobody has measured are listed in its key assumed.
    """
    from sealtwin.trial.starter_files import write_starter

    names = [*map(str, write_starter(folder))]
    command.reply({"files": names}, names)
