"""The table of figures of README and the paper, and the page of figures and misses, from reports/results.json.

    python -m benchmarks.headline

A figure of the table has a key, the name of a benchmark and that of a row. The command writes the table into README.md,
docs/paper/paper.md and docs/figures.md, where the page lists each target that is missed, and the sections with their
runs. A test compares these files.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.results import RESULTS, counts, seen
from sealtwin.core.files import write_text
from sealtwin.core.run_folder import number_words, other_numbers
from sealtwin.trial.job import NUMBERS
from tests.support.paths import ROOT

PAGE = ROOT / "docs" / "figures.md"
WITH_TABLE = (ROOT / "README.md", ROOT / "docs" / "paper" / "paper.md")
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
    """Return the text of README or the paper with the table of these results."""
    before, _, rest = page.partition(BEGIN)
    return before + BEGIN + table(results) + END + rest.partition(END)[2]


def page(results: Mapping[str, Any]) -> str:
    """Return the page of figures and misses."""
    rows = [row for section in results.values() for row in section["rows"]]
    lines = [
        "# Figures",
        "",
        "`python -m benchmarks.headline` writes this page from `reports/results.json`, which `make results` writes and "
        f"which has every figure. **{counts(rows)} targets are met.** {_of_one_solver(results)}",
        "",
        table(results),
        "## Targets that are missed",
        "",
        "| section | figure | target | seen |",
        "|---|---|---|---|",
    ]
    for name, section in results.items():
        for row in section["rows"]:
            if row["missed"]:
                lines.append(f"| {name} | {row['name'].replace('|', chr(92) + '|')} | {row['target']} | {seen(row)} |")
    lines += ["", "## Sections", "", "| section | targets met | date, commit, processor |", "|---|---|---|"]
    for name, section in results.items():
        run = f"{section['date']}, {section['commit']}, {section['processor'].replace('(R)', '')}"
        lines.append(f"| {name} | {counts(section['rows'])} | {run} |")
    return "\n".join([*lines, ""])


def _of_one_solver(results: Mapping[str, Any]) -> str:
    """Return the sentence on whether all sections were computed by this version's stage numbers."""
    by = {name: section["stage_numbers"] for name, section in results.items()}
    own = {name: {stage: NUMBERS[stage] for stage in numbers} for name, numbers in by.items()}
    if older := [f"`{name}`" for name, numbers in by.items() if other_numbers(numbers, own[name])]:
        words = number_words(NUMBERS)
        return f"This version has the stage numbers {words}; computed by others: {', '.join(older)}."
    return f"All were computed by {number_words(NUMBERS)}, the stage numbers of this version."


def main(texts: Sequence[Path] = WITH_TABLE, figures: Path = PAGE) -> None:
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    for path in texts:
        write_text(path, with_table(path.read_text(encoding="utf-8"), results))
    write_text(figures, page(results))


if __name__ == "__main__":
    main()
