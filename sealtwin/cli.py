"""The command line: its commands, and what they have in common."""

from typing import Annotated

import typer

from sealtwin.answering import Commands
from sealtwin.commands import (
    compare,
    digitise,
    film,
    import_mesh,
    lab,
    map,
    markers,
    robot,
    setup,
    stages,
    sweep,
    trace,
)

app = typer.Typer(
    name="sealtwin",
    cls=Commands,
    help="From a photo of a cracked pavement sample and a measured depth to a validated digital twin of its sealing.",
    epilog=(
        "Exit codes: 0 ok, 1 a bug of ours, 2 usage, 3 bad input, 4 numerical failure, "
        "5 the trial's gate failed (the report is complete), 6 some of a batch failed, 130 interrupted."
    ),
    no_args_is_help=True,
    add_completion=False,
    # Locals would put the user's paths and data into a bug report.
    pretty_exceptions_enable=False,
)
# In the order in which --help lists them.
for command in (
    stages.demo,
    stages.run,
    trace.trace,
    digitise.digitise,
    import_mesh.import_mesh,
    lab.ingest,
    lab.lab,
    stages.simulate,
    stages.validate,
    film.film,
    sweep.sweep,
    map.map,
    compare.compare,
    robot.robot,
    markers.markers,
    setup.init,
    setup.doctor,
):
    app.command()(command)


@app.callback(invoke_without_command=True)
def common(
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
) -> None:
    if version:
        from importlib.metadata import version as installed

        print(installed("sealtwin"))
        raise typer.Exit


def main() -> None:
    """The ``sealtwin`` command."""
    app()


if __name__ == "__main__":
    main()
