"""The list of all commands, the command 'doctor', which checks an installation, and the main function."""

import atexit
import gc
import logging
import signal
import sys
import time
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from sealtwin.cli import lab, material, samples, studies, trials
from sealtwin.cli.answer import (
    BUG,
    CheckedCommand,
    Command,
    Commands,
    answers,
    ending,
    open_missing_streams,
    take_any_name,
)
from sealtwin.core.errors import InputError
from sealtwin.core.plain_files import read_bytes

app = typer.Typer(
    name="sealtwin",
    cls=Commands,
    help="Make a digital twin of a crack's sealing from a photo of a cracked pavement sample and a measured depth.",
    epilog=(
        "Exit codes: 0 ok, 1 bug, 2 wrong usage, 3 bad input, 4 numerical failure, "
        "5 the trial missed its gate, or its readings do not decide it (the report is complete), "
        "6 part of a batch failed, 130 interrupted."
    ),
    no_args_is_help=True,
    # Tracebacks with local variables would show the user's paths and data in a bug report.
    pretty_exceptions_enable=False,
)
OBJECTS_A_COLLECTION = 200_000
"""Number of new objects that starts a garbage collection. With Python's default of 700, figures take 10 % longer."""


@answers()
def doctor(command: Command) -> None:
    """Print versions, stage numbers, devices and the results of self-tests. Takes about a second."""
    from sealtwin.core.run_folder import number_words, versions
    from sealtwin.trial.job import NUMBERS

    checks: dict[str, str] = {}
    healthy = True
    for name, check in SELF_TESTS.items():
        began = time.perf_counter()
        try:
            checks[name] = f"ok, {check()} ({time.perf_counter() - began:.1f} s)"
        except Exception as fault:  # A self-test fails by any exception, which is printed.
            checks[name] = f"FAILED: {type(fault).__name__}: {fault}"
            healthy = False
    content = {"versions": versions(), "stage_numbers": NUMBERS, "checks": checks, "healthy": healthy}
    facts = {**versions(), **checks}
    facts["sealtwin"] += f", stage numbers {number_words(NUMBERS)}"
    lines = [f"{name:<24} {fact}" for name, fact in facts.items()]
    command.reply(content, lines, 0 if healthy else BUG)


def _photo() -> str:
    """Draw a marker and detect it. The test fails if OpenCV was built without the module aruco, a common fault."""
    import cv2
    import numpy as np

    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    photo = np.full((160, 160), 255, np.uint8)
    photo[30:130, 30:130] = cv2.aruco.generateImageMarker(dictionary, 7, 100)
    _, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(photo)
    if ids is None or ids.ravel().tolist() != [7]:
        raise RuntimeError(f"marker 7 was drawn, but {ids} was detected")
    return "marker drawn and detected"


def _mesh() -> str:
    from manifold3d import Manifold

    volume_mm3 = (Manifold.cube((10.0, 10.0, 10.0)) - Manifold.cube((4.0, 4.0, 10.0))).volume()
    if abs(volume_mm3 - 840.0) > 1e-9:
        raise RuntimeError(f"10 x 10 x 10 mm minus 4 x 4 x 10 mm gave {volume_mm3} mm3 instead of 840 mm3")
    return "cavity cut with its exact volume"


def _devices() -> str:
    from simulate.device import choose_device, describe_device

    return ", ".join(dict.fromkeys(describe_device(choose_device(name)) for name in ("cpu", "auto")))


def _fluid() -> str:
    """Compile, run and record kernels on the device "auto", and compare their results with exact numbers."""
    from simulate.device import SIDE, choose_device, touching_pairs, turns_of_a_recording

    device = choose_device("auto")
    # In each of 3 directions there are 7 x 8 x 8 pairs.
    if (pairs := touching_pairs(device)) != 1344:
        raise RuntimeError(f"{device} counts {pairs} touching pairs in a lattice of 8 x 8 x 8 instead of 1344")
    turns = turns_of_a_recording(device)
    if turns != SIDE:
        raise RuntimeError(f"a recorded loop made {turns} turns on {device} instead of {SIDE}")
    return f"kernels compiled, run and recorded on {device}"


def _report() -> str:
    """Draw a figure as SVG without a screen."""
    import io

    from matplotlib.figure import Figure

    Figure().savefig(io.BytesIO(), format="svg")
    return "figure drawn without a screen"


SELF_TESTS: dict[str, Callable[[], str]] = {
    "photo": _photo,
    "mesh": _mesh,
    "devices": _devices,
    "fluid": _fluid,
    "report": _report,
}


# --help lists the commands in this order.
for command in (
    trials.demo,
    trials.quick,
    trials.run,
    samples.trace,
    samples.digitise,
    lab.ingest,
    lab.lab,
    trials.simulate,
    trials.validate,
    studies.sweep,
    studies.map,
    studies.compare,
    studies.calibrate,
    trials.robot,
    samples.export,
    samples.markers,
    studies.plan,
    trials.init,
    doctor,
):
    app.command(cls=CheckedCommand)(command)
app.add_typer(material.methods)


def require_own_packages() -> None:
    """Raise InputError if the package digitise, simulate or validate is not sealtwin's own.

    Other projects contain packages with these names: configobj, for example, contains a package validate. The packages
    are not imported here. pip may have overwritten an __init__.py, which then does not contain the line PART_OF.
    """
    for name in ("digitise", "simulate", "validate"):
        file = Path(__file__).absolute().parents[2] / name / "__init__.py"
        spec = find_spec(name)
        # The spec of a folder without an __init__.py has no origin.
        origin = file if spec is None or spec.origin is None else Path(spec.origin)
        if not (file.is_file() and origin.samefile(file) and b'PART_OF = "sealtwin"' in read_bytes(file)):
            raise InputError(
                f"{origin}: '{name}' is not sealtwin's own package. Rename it, start sealtwin in another folder, or "
                "install sealtwin in a separate environment ('uv tool install', 'pipx install' or a new venv)."
            )


@app.callback(invoke_without_command=True)
def common(version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False) -> None:
    with ending(Command(as_json="--json" in sys.argv)):
        require_own_packages()
    if version:
        from sealtwin import __version__

        print(__version__)
        raise typer.Exit


def main() -> None:
    open_missing_streams()
    take_any_name()
    if not sys.warnoptions:
        # Users cannot correct the causes of libraries' warnings. In tests, each such warning is an error.
        warnings.simplefilter("ignore")
        # Without a handler, Python prints the logs of libraries on stderr.
        logging.getLogger().addHandler(logging.NullHandler())
    # docker stop, a cluster's scheduler and kill end a command as Ctrl-C does.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    gc.set_threshold(OBJECTS_A_COLLECTION, *gc.get_threshold()[1:])
    # Without this, Python searches all objects for cycles when it ends, which takes half a second after a run.
    atexit.register(gc.freeze)
    app()


if __name__ == "__main__":
    main()
