"""The figures of README and docs, and the page of targets that are missed, from reports/results.json.

    python -m benchmarks.headline

``benchmarks/figures.toml`` has the figures of each page. A section whose code changed since it ran is in no count.
``results.json`` records which sections these are, so that a test can compare the pages with it at any commit.
"""

import re
import tomllib
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from benchmarks.results import COMMANDS, RESULTS, Content, code_sha256, counts, read, seen
from sealtwin.core.files import write_json, write_text
from tests.support.paths import ROOT

PAGE = ROOT / "docs" / "figures.md"
PAGES = ("accuracy.md", "validation.md", "paper/paper.md", "how-to/calibrate-then-hold-out.md")
WITH_FIGURES = (ROOT / "README.md", *(ROOT / "docs" / name for name in PAGES))
OLDER = "older code"
"""Of a section whose code changed since it ran."""
BLOCK = re.compile(r"(<!-- benchmarks.headline: (\w+) -->\n).*?(?=<!-- end -->)", re.DOTALL)
Row = Mapping[str, Any]
FIGURES: Mapping[str, Sequence[Mapping[str, Any]]] = tomllib.loads(
    Path(__file__).with_name("figures.toml").read_text(encoding="utf-8")
)
"""Figures of each comment of a page, in parts of one section each."""


def with_figures(page: str, results: Content) -> str:
    """Return the text of a page with the figures of these results. Raises KeyError for a row that they lack."""
    return BLOCK.sub(lambda block: block[1] + _figures(FIGURES[block[2]], results), page)


def _figures(parts: Sequence[Mapping[str, Any]], results: Content) -> str:
    several, columns = len(parts) > 1, parts[0].get("columns")
    lines = []
    if columns:
        columns += " | section" * several
        lines += [f"| {columns} |", "|---" * (columns.count("|") + 1) + "|"]
    for part in parts:
        section = results[part["section"]]
        by = f" `{part['section']}`{f', {OLDER}' * section['older']} |" * several
        for text, *patterns in part["rows"]:
            line = _filled(text, [row for pattern in patterns for row in _matching(section["rows"], pattern)])
            lines.append(f"| {line} |{by}" if columns else f"- {line}.")
    if not several:
        lines += ["", _run(results[parts[0]["section"]])]
    return "\n".join([*lines, ""])


def _matching(rows: Sequence[Row], pattern: str) -> list[Row]:
    if matching := [row for row in rows if fnmatchcase(row["name"], pattern)]:
        return matching
    raise KeyError(pattern)


def _filled(text: str, rows: Sequence[Row]) -> str:
    """Return a text with the values of rows, and with the targets that they miss."""
    values, targets = ([row[key] for row in rows] for key in ("value", "target"))
    missed = ", ".join(dict.fromkeys(row["target"] for row in rows if row["missed"]))
    filled = text.format(*values, least=min(values), most=max(values), targets=targets)
    return filled + f" (**missed**: {missed})" * bool(missed)


def _run(section: Mapping[str, Any]) -> str:
    """Return the sentence on the run of a section."""
    return f"`{section['command']}`, {section['date']}, {_processor(section)}: {_met(section)}."


def _met(section: Mapping[str, Any]) -> str:
    """Return how many targets of a section are met. Some sections have no target."""
    if section["older"]:
        return OLDER
    if not any(row["judged"] for row in section["rows"]):
        return "no target"
    return f"{counts(section['rows'])} targets met"


def _processor(section: Mapping[str, Any]) -> str:
    return section["processor"].replace("(R)", "")


def totals(results: Content) -> str:
    """Return the sentence on all sections whose code has not changed since."""
    current = [section for section in results.values() if not section["older"]]
    met = counts([row for section in current for row in section["rows"]])
    return f"{met} targets are met, counting the {len(current)} of {len(results)} sections whose code is unchanged."


def page(results: Content) -> str:
    """Return the page of misses and sections."""
    lines = [
        "# Figures",
        "",
        "`python -m benchmarks.headline` writes this page from `reports/results.json`, which `make results` writes and "
        f"which has every figure. **{totals(results)}**",
        "",
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
        met = _met(section).removesuffix(" targets met")
        lines.append(f"| {name} | {met} | {section['date']}, {section['commit']}, {_processor(section)} |")
    return "\n".join([*lines, ""])


def main(texts: Sequence[Path] = WITH_FIGURES, figures: Path = PAGE) -> None:
    results = read(RESULTS)
    for name, section in results.items():
        section["older"] = section["code"] != code_sha256(ROOT, COMMANDS[name])
    write_json(RESULTS, results)
    for path in texts:
        write_text(path, with_figures(path.read_text(encoding="utf-8"), results))
    write_text(figures, page(results))


if __name__ == "__main__":
    main()
