"""Finished runs side by side."""

from pathlib import Path
from typing import Annotated

import typer

from sealtwin.answering import Json, Quiet, answering


def compare(
    folders: Annotated[list[Path], typer.Argument(metavar="RUN RUN ...", help="Run folders, 2 to 28.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where the page goes.")] = Path(
        "reports", "compare"
    ),
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Put runs side by side: settings that differ, levels and errors in one plot, figures, held-out trials.

    Replicates, which have the same settings and readings of their own, also get the area validation metric.

    Example: sealtwin compare reports/paper-trial reports/paper-trial-lean
    """
    with answering("cpu", as_json, quiet) as command:
        if len(folders) < 2:
            raise typer.BadParameter("give two run folders or more")
        from sealtwin.study.comparing import compare_runs

        compared = compare_runs(folders, out)
        command.answer(compared.content, compared.lines)
