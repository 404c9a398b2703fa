"""README's table of figures, each by its key from reports/results.json.

    python -m benchmarks.headline

A key is the name of a benchmark and that of a row. The command writes the table into README.md, and a test compares it.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.against import HERE
from sealtwin.core.files import write_text

README, RESULTS = HERE / "README.md", HERE / "reports" / "results.json"
BEGIN, END = "<!-- By 'python -m benchmarks.headline', from reports/results.json -->\n", "<!-- end -->\n"
SEEDS = range(5)


class Figure(NamedTuple):
    """A row of the table."""

    name: str
    text: str
    """Format of the values: by position, or their least and most."""
    benchmark: str
    rows: Sequence[str]
    """Names of the rows whose values the text has."""


FIGURES = (
    Figure(
        "the paper's trial (reconstructed), fitted: mean error over five seeds; the paper has 1.26 mm",
        "{least:.2f} to {most:.2f} mm",
        "paper_trial",
        [f"flare 5.5, accurate, seed {seed}: mean error" for seed in SEEDS],
    ),
    Figure("a parabola through the same readings", "{:.2f} mm", "paper_trial", ["a parabola: mean error"]),
    Figure(
        "sealant kept by a run, over that dispensed",
        "{least:.3f} to {most:.3f}",
        "paper_trial",
        [f"flare 5.5, accurate, seed {seed}: volume ratio" for seed in SEEDS],
    ),
    Figure(
        "fronts of six dam breaks that others measured, computed over measured: bias, scatter; bias with half the step",
        "{:.2f}, {:.0f} %; {:.2f}",
        "measured_numerics",
        [
            "usual step: computed over measured fronts over 10 mm, bias",
            "usual step: their scatter",
            "two substeps: computed over measured fronts over 10 mm, bias",
        ],
    ),
    Figure(
        "band of a prediction before the pour, 20 emulated trials: level at a place; mean level",
        "± {:.1f}; ± {:.2f} mm",
        "blind_own_band",
        ["W0: half of the band, median", "W0: half of a mean level's interval, median"],
    ),
    Figure(
        "its RMS error if another flow model is the truth: particles; the fast model; a flat line of its volume",
        "{:.1f}; {:.1f}; {:.1f} mm",
        "blind_own_band",
        ["W0: level off by, RMS", "W0: fast model off by, RMS", "W0: flat line by volume off by, RMS"],
    ),
    Figure(
        "the same, if particles of another seed and size are the truth",
        "{:.1f}; {:.1f}; {:.1f} mm",
        "blind_own_band",
        [
            "particles: level off by, RMS",
            "particles: fast model off by, RMS",
            "particles: flat line by volume off by, RMS",
        ],
    ),
    Figure(
        "traced cracks, worst of 32 clean photos with exact truth: mean width; walls, RMS",
        "{:.1f} %; {:.2f} mm",
        "tracing",
        ["clean: mean width, worst of 32", "clean: walls RMS, worst of 32"],
    ),
)


def table(results: Mapping[str, Any]) -> str:
    """Return the table of README. Raises KeyError for a key that the results lack."""
    lines = ["| figure | value | command |", "|---|---|---|"]
    for figure in FIGURES:
        section = results[figure.benchmark]
        by_name = {row["name"]: row["value"] for row in section["rows"]}
        values = [by_name[name] for name in figure.rows]
        text = figure.text.format(*values, least=min(values), most=max(values))
        lines.append(f"| {figure.name} | {text} | `{section['command']}` |")
    return "\n".join([*lines, ""])


def with_table(page: str, results: Mapping[str, Any]) -> str:
    """Return README's text with the table of these results."""
    before, _, rest = page.partition(BEGIN)
    return before + BEGIN + table(results) + END + rest.partition(END)[2]


def main(readme: Path = README) -> None:
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    write_text(readme, with_table(readme.read_text(encoding="utf-8"), results))


if __name__ == "__main__":
    main()
