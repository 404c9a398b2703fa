"""Output shown in README and documentation, compared with what its commands print; as a command, rewritten.

``python -m tests.shown_output [--rewrite] [--quick] [--only PAGE]`` prints each difference as a diff; it ends with 1 if
there is one. A page's commands run in order in one scratch folder with the two trials of
``fixtures``. Words behind a block's language:

- ``sh`` and ``python`` are run. ``slow``: over some 20 s, and so is what follows on the page. ``exits N``: with this
  code in place of 0. ``not-run``: needs what only the reader has, a network, or hours.
- ``text`` is output of the last command of the block directly above. ``of COMMAND``: of that command, anywhere above.
  ``not-output``: no command prints it. A line ``...`` stands for lines that are left out.
- ``<!-- sh`` and ``<!-- python``, up to ``-->``, are run and not shown: what the reader does by hand or on other pages.

Output is the answer on stdout, after the notes and cautions of stderr. Texts must be equal, and numbers within 1 % of
each other; FACTS are not compared. What agrees is not rewritten.
"""

import argparse
import contextlib
import difflib
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from typer.testing import CliRunner

from sealtwin.cli.app import app
from tests.support.paths import FIXTURE, ROOT

PAGES = tuple(
    path.relative_to(ROOT).as_posix()
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md")))
    # Copies and generated pages, of records and examples.
    if not {"decisions", "gallery", "_build"} & set(path.relative_to(ROOT).parts)
)
LEFT_OUT = "..."
TOLERANCE = 0.01
FACTS = tuple(
    re.compile(pattern)
    for pattern in (
        r"\b\d{4}-\d\d-\d\d(?:[T ]\d\d:\d\d(?::\d\d)?)?",  # Date and time of day
        r"\b\d+(?:\.\d+){2,}(?:[\w.+-]*\w)?",  # Version, as 1.0.0rc1
        r"\b(?=\d*[a-f])(?=[a-f]*\d)[0-9a-f]{8,64}\b",  # Hash
        r"\bCPU \([^)]*\)|\bcuda:\d+(?: \([^)]*\))?",  # Device
        r"(?<!\S)(?:[A-Z]:)?/(?:tmp|var|private|home|Users)/\S+",  # Folder of this machine
        r"(?<![\w.])\d[\d.,]*(?: to \d[\d.,]*)? ?(?:ms|s|min|h|seconds?|minutes?|hours?)\b(?!/)",  # Time
        r"(?<![\w.])\d[\d.,]* ?[kMG]i?B\b",  # Memory
    )
)
"""Words that depend on the machine and the day, which are not compared."""
NUMBER = re.compile(r"(?<![\w.])([-+]?\d+(?:,\d{3})*(?:\.\d+)?(?:[eE][-+]?\d+)?)")
MARK = re.compile(r"(?P<slow>slow)|(?P<not_run>not-run)|exits (?P<exits>\d+)|(?P<not_output>not-output)|of (?P<of>.+)")
ALLOWED_MARKS = {
    "sh": {"slow", "not_run", "exits"},
    "python": {"slow", "not_run"},
    "text": {"of", "not_output"},
    "toml": set[str](),
}
NOTE = re.compile("note: |caution: |sealtwin: ")


@dataclass(frozen=True)
class Block:
    language: str
    mark: str  # Words behind the language
    start: int  # Index of its first line on the page
    lines: tuple[str, ...]
    hidden: bool  # In a comment

    @property
    def is_run(self) -> bool:
        return self.language in {"sh", "python"} and self.mark != "not-run"

    @property
    def commands(self) -> list[str]:
        """Commands of a shell block, without comments."""
        lines = [re.sub(r"(?:^|\s+)#.*", "", line).strip() for line in self.lines]
        return [line for line in lines if line]


@dataclass(frozen=True)
class Difference:
    page: str
    block: Block
    lines: tuple[str, ...]  # What the block should show

    def __str__(self) -> str:
        at = f"{self.page}:{self.block.start + 1}"
        return "\n".join(
            difflib.unified_diff(self.block.lines, self.lines, f"{at} shown", f"{at} printed", lineterm="")
        )


class NoAnswerError(AssertionError):
    """A block that cannot be run as it is marked."""


def read_page(page: str) -> list[str]:
    return (ROOT / page).read_text(encoding="utf-8").splitlines()


def blocks_of(lines: Sequence[str]) -> Iterator[Block]:
    """Yield fenced blocks and hidden ones; Sphinx's directives and the lists of other fences are none."""
    opened: tuple[int, str, str, str] | None = None
    for index, line in enumerate(lines):
        if opened is None:
            if opening := re.fullmatch(r"(```|<!--) ?(\w*) ?(.*)", line):
                fence, language, mark = opening.groups()
                if fence == "<!--" and language not in {"sh", "python"}:
                    continue
                opened = (index + 1, "-->" if fence == "<!--" else fence, language, mark.strip())
        elif line == opened[1]:
            start, end, language, mark = opened
            if not mark.startswith("{"):
                yield Block(language, mark, start, tuple(lines[start:index]), end == "-->")
            opened = None
    assert opened is None, f"a block that begins at line {opened[0]} has no end"


def faults_of(blocks: list[Block]) -> Iterator[str]:
    """Yield a sentence for each block whose kind or mark is unknown, or which shows the output of nothing."""
    for above, block in pairwise([Block("", "", 0, (), False), *blocks]):
        where = f"line {block.start}: {block.language} {block.mark}".rstrip()
        mark = MARK.fullmatch(block.mark)
        if block.language not in ALLOWED_MARKS:
            yield f"{where}: no such kind of block; give sh, python, toml or text"
        elif block.mark and (mark is None or mark.lastgroup not in ALLOWED_MARKS[block.language]):
            yield f"{where}: no such mark; see tests/shown_output.py"
        elif block.language == "text" and not block.mark and not (above.is_run or above.language == "text"):
            yield f"{where}: directly above it nothing is run; say 'of COMMAND', or 'not-output'"


def is_slow(blocks: list[Block]) -> bool:
    return any(block.mark == "slow" for block in blocks)


def differences_of(page: str, lines: Sequence[str], folder: Path, *, quick: bool = False) -> Iterator[Difference]:
    """Run the page's blocks in ``folder``, if ``quick`` as far as the first slow one, and yield what is to change."""
    printed: dict[str, list[str]] = {}
    last: list[str] = []
    for fixture in (FIXTURE, FIXTURE.with_name("real-crack")):
        shutil.copytree(fixture, folder / "fixtures" / fixture.name)
    for block in blocks_of(lines):
        mark = MARK.fullmatch(block.mark)
        if quick and block.mark == "slow":
            return
        if block.is_run:
            code = int(mark["exits"] or 0) if mark else 0
            if block.language == "python":
                last = _printed_by_script(block, folder)
            for line in block.commands if block.language == "sh" else []:
                last = printed[line] = _printed_by_command(line, folder, code)
        elif block.language == "text" and block.mark != "not-output":
            shown = list(block.lines)
            if mark and mark["of"] not in printed:
                raise NoAnswerError(f"line {block.start}: no block above runs {mark['of']}")
            new = rewritten(shown, printed[mark["of"]] if mark else last)
            if new != shown:
                yield Difference(page, block, tuple(new))


def rewritten(shown: list[str], printed: list[str]) -> list[str]:
    """``shown`` if it agrees with ``printed``, otherwise the lines that are printed.

    Lines before a first ``...`` are the first that are printed, those after a last one the last; lines between two are
    looked for where most of their text is.
    """
    parts = _split(shown)
    if len(parts) == 1 or sum(map(len, parts)) > len(printed):
        return _kept(shown, printed)
    new, start = [], 0
    for number, part in enumerate(parts):
        if number == len(parts) - 1:
            start = len(printed) - len(part)
        elif number:
            text = "\n".join(part)
            start = max(
                range(start, len(printed) - len(part) + 1),
                key=lambda at: difflib.SequenceMatcher(None, text, "\n".join(printed[at : at + len(part)])).ratio(),
            )
        new += [*([LEFT_OUT] if number else []), *_kept(part, printed[start : start + len(part)])]
        start += len(part)
    return new


def agree(shown: str, printed: str) -> bool:
    """Return whether two lines have the same text, and numbers within 1 % of each other. Spaces in a row count as 1."""
    texts, numbers = zip(*map(_texts_and_numbers, (shown, printed)), strict=True)
    return texts[0] == texts[1] and all(
        abs(one - other) <= TOLERANCE * max(abs(one), abs(other)) for one, other in zip(*numbers, strict=True)
    )


def _texts_and_numbers(line: str) -> tuple[list[str], list[float]]:
    line = " ".join(line.replace("\\", "/").split())
    for fact in FACTS:
        line = fact.sub("<fact>", line)
    parts = NUMBER.split(line)
    return parts[::2], [float(number.replace(",", "")) for number in parts[1::2]]


def _kept(shown: list[str], printed: list[str]) -> list[str]:
    return shown if len(shown) == len(printed) and all(map(agree, shown, printed)) else printed


def _split(lines: list[str]) -> list[list[str]]:
    parts: list[list[str]] = [[]]
    for line in lines:
        if line == LEFT_OUT:
            parts.append([])
        else:
            parts[-1].append(line)
    return parts


def _printed_by_command(line: str, folder: Path, code: int) -> list[str]:
    program, *arguments = shlex.split(line)
    if program != "sealtwin":
        raise NoAnswerError(f"{line}\nonly sealtwin is run; mark the block not-run")
    with contextlib.chdir(folder):
        answer = CliRunner().invoke(app, arguments)
    if answer.exit_code != code:
        raise NoAnswerError(f"{line}\nexit code {answer.exit_code}, not {code}\n{answer.stderr}")
    return [*filter(NOTE.match, answer.stderr.splitlines()), *answer.stdout.splitlines()]


def _printed_by_script(block: Block, folder: Path) -> list[str]:
    answer = subprocess.run(
        [sys.executable, "-c", "\n".join(block.lines)],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    if answer.returncode:
        raise NoAnswerError(f"the Python at line {block.start}\n{answer.stderr}")
    return answer.stdout.splitlines()


def main(arguments: list[str] | None = None) -> int:
    """Print every difference, rewrite the blocks if asked to, and return 1 if there was one."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.shown_output", description="Compare shown output with printed."
    )
    parser.add_argument("--rewrite", action="store_true", help="write what is printed into the pages")
    parser.add_argument("--quick", action="store_true", help="leave out slow blocks and what follows them")
    parser.add_argument("--only", metavar="PAGE", help="one page, as docs/tutorial.md")
    chosen = parser.parse_args(arguments)
    if chosen.only not in {None, *PAGES}:
        parser.error(f"no page {chosen.only}; there are {', '.join(PAGES)}")
    differs = False
    for page in [chosen.only] if chosen.only else PAGES:
        lines = read_page(page)
        with tempfile.TemporaryDirectory() as folder:
            try:
                differences = list(differences_of(page, lines, Path(folder), quick=chosen.quick))
            except NoAnswerError as fault:
                print(f"{page}: {fault}")  # noqa: T201
                differs = True
                continue
        for difference in differences:
            print(difference)  # noqa: T201
        # From the end, so that the lines of the others stay where they are.
        for difference in reversed(differences):
            start = difference.block.start
            lines[start : start + len(difference.block.lines)] = difference.lines
        if differences and chosen.rewrite:
            (ROOT / page).write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
        differs |= bool(differences)
    return int(differs)


if __name__ == "__main__":
    sys.exit(main())
