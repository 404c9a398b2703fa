"""The command line: all commands, and the main function."""

import gc
import logging
import sys
import warnings
from typing import Annotated

import typer

from sealtwin.cli import doctor, lab, material, samples, studies, trials
from sealtwin.cli.answer import CheckedCommand, Commands, open_missing_streams, take_any_name

app = typer.Typer(
    name="sealtwin",
    cls=Commands,
    help="From a photo of a cracked pavement sample and a measured depth to a digital twin of its sealing.",
    epilog=(
        "Exit codes: 0 ok, 1 a bug, 2 usage, 3 bad input, 4 numerical failure, "
        "5 the trial's gate missed (the report is complete), 6 some of a batch failed, 130 interrupted."
    ),
    no_args_is_help=True,
    add_completion=False,
    # Locals would put the user's paths and data into a bug report.
    pretty_exceptions_enable=False,
)
OBJECTS_A_COLLECTION = 200_000
"""Objects between two garbage collections: with Python's default of 700, drawing a figure takes 10 % longer."""
# In the order in which --help lists them.
for command in (
    trials.demo,
    trials.quick,
    trials.run,
    samples.trace,
    samples.digitise,
    samples.import_mesh,
    samples.import_dxf,
    lab.ingest,
    trials.simulate,
    trials.validate,
    trials.film,
    studies.sweep,
    studies.map,
    studies.compare,
    studies.calibrate,
    trials.robot,
    samples.export,
    samples.markers,
    studies.plan,
    trials.init,
    doctor.doctor,
):
    app.command(cls=CheckedCommand)(command)
app.add_typer(lab.catalogue)
app.add_typer(material.methods)


@app.callback(invoke_without_command=True)
def common(version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False) -> None:
    if version:
        from importlib.metadata import version as installed

        print(installed("sealtwin"))
        raise typer.Exit


def main() -> None:
    open_missing_streams()
    take_any_name()
    if not sys.warnoptions:
        # Users cannot fix what libraries warn about; in tests each such warning is an error.
        warnings.simplefilter("ignore")
        # Without a handler, Python prints the logs of libraries on stderr.
        logging.getLogger().addHandler(logging.NullHandler())
    gc.set_threshold(OBJECTS_A_COLLECTION, *gc.get_threshold()[1:])
    app()


if __name__ == "__main__":
    main()
