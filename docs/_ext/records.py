"""Decision records as pages: each as it is, what a later one changed marked, and a list of all."""

import re
from pathlib import Path

SUPERSEDES = re.compile(r"Supersedes\b[^.]*")
NUMBER = re.compile(r"\b\d{4}\b")
OUTSIDE_LINK = re.compile(r"\[([^\]]+)\]\((?:\.\./)+[^)]*\)")
INTRODUCTION = """\
# Decisions

A record says why something is as it is: question, choice, alternatives, and what would change our mind. You do not need
them to use sealtwin. A record is never edited; a later one supersedes it, and is named beside it here.
Paths in a record are those of its day.

"""


def pages_of(records: Path) -> dict[str, str]:
    """The text of each page by its name, the list of records among them as ``index``."""
    texts = {path.stem: path.read_text(encoding="utf-8") for path in sorted(records.glob("*.md"))}
    changed = superseding(texts)
    pages, lines = {}, []
    for stem, text in texts.items():
        title, _, body = text.partition("\n")
        later = ", ".join(f"[{name[:4]}]({name}.md)" for name in changed.get(stem, []))
        note = f"\n:::{{admonition}} Superseded\nBy {later}, in whole or in part.\n:::\n" if later else ""
        # A file outside the documentation is named, not linked.
        pages[stem] = title + "\n" + note + OUTSIDE_LINK.sub(r"\1", body)
        mark = f" *(superseded, in whole or in part, by {later})*" if later else ""
        lines.append(f"- [{title.removeprefix('# ')}]({stem}.md){mark}")
    toctree = "\n".join(["```{toctree}", ":hidden:", "", *texts, "```"])
    pages["index"] = INTRODUCTION + "\n".join([*lines, "", toctree, ""])
    return pages


def superseding(texts: dict[str, str]) -> dict[str, list[str]]:
    """Names of the later records that change each record, by its name."""
    by_number = {stem[:4]: stem for stem in texts}
    changed: dict[str, list[str]] = {}
    for stem, text in texts.items():
        numbers = {number for sentence in SUPERSEDES.findall(text) for number in NUMBER.findall(sentence)}
        for number in sorted(numbers & by_number.keys()):
            changed.setdefault(by_number[number], []).append(stem)
    return changed
