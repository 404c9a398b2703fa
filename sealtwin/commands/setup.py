"""Commands about the installation and what one starts from."""

from pathlib import Path
from typing import Annotated

import typer

from sealtwin.answering import Json, answering


def init(folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where the trial is to lie.")]) -> None:
    """Write a commented trial and an empty sheet for readings to start from."""
    with answering("auto", as_json=False, quiet=False) as command:
        from sealtwin.trials.starter import write_starter

        command.answer({}, [str(written) for written in write_starter(folder)])


def doctor(as_json: Json = False) -> None:
    """Versions, devices and a self-test of about a second."""
    with answering("auto", as_json, quiet=False) as command:
        from sealtwin.doctor import examine

        findings = examine()
        lines = [f"{name:<24} {found}" for name, found in {**findings["versions"], **findings["checks"]}.items()]
        command.answer(findings, lines)
        if not findings["healthy"]:
            raise typer.Exit(1)
