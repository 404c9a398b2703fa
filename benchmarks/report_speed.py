"""The report of the reconstructed trial, once its run is there: how long it takes, how large and how long it is.

    python benchmarks/report_speed.py [--out DIR]

Runs the trial first where it is not up to date. Each report is made on a copy of the run folder by 'sealtwin validate':
imports, hashes, comparison, its uncertainty, page, PDF and JSON. Time is that of all threads.

What a reader sees is measured in Chromium, which 'make test-browser' installs.
"""

import importlib
import os
import platform
import shutil
import statistics
import tempfile
from pathlib import Path
from typing import Annotated, Any

from pypdf import PdfReader
from typer import Option

from benchmarks.against import run_program
from benchmarks.paper_trial import FIXTURE
from benchmarks.table import Row, run_benchmark
from sealtwin.core.run_folder import open_folder

REPORTS = 3
FILES = {"the page": "report.html", "the PDF": "report.pdf", "the file for programs": "report.json"}
LONGEST_S = 10.0
LARGEST_MB = 3.0
MOST_FIRST_WORDS, MOST_WORDS, MOST_PAGES = 130, 1000, 4
"""All are the issue's."""
DESK_PX, PHONE_PX = 1280, 390  # Widths of a window
LOOK = """() => {
  const [all, before] = [document.documentElement, document.getElementById("appendix")];
  const outside = (inner, outer) => inner.left < outer.left - 1 || inner.right > outer.right + 1;
  const beyond = (inner, outer) => inner.top < outer.top - 1 || inner.bottom > outer.bottom + 1;
  const box = (part) => part.getBoundingClientRect();
  const cutOff = (inner, outer) => outside(inner, outer) || beyond(inner, outer);
  const hides = (part) => getComputedStyle(part).overflowX;
  // True if nobody can bring a part into view: what overflows a box that scrolls is not cut, if the box itself is not.
  const isCut = (part) => {
    for (let outer = part.parentElement; outer && outer !== document.body; outer = outer.parentElement) {
      if (["auto", "scroll"].includes(hides(outer))) {
        if (box(part).left + outer.scrollLeft < box(outer).left - 1) return true;
        part = outer;
      } else if (hides(outer) !== "visible" && outside(box(part), box(outer))) return true;
    }
    return outside(box(part), { left: 0, right: all.clientWidth });
  };
  const isClipped = (part) => ["hidden", "clip"].includes(hides(part)) && part.clientWidth > 1
    && part.scrollWidth > part.clientWidth + 1 && part.textContent.trim() !== "";
  const parts = [...document.querySelectorAll("figure svg, figure img, table, .verdict, .key")]
    .filter((part) => part.getClientRects().length > 0);
  const boxes = [...document.body.querySelectorAll(":not(svg, svg *)")];
  const words = [...document.querySelectorAll("figure svg text")];
  const text = document.body.cloneNode(true);
  text.querySelectorAll("svg, script, #appendix ~ *").forEach((part) => part.remove());
  return {
    height_px: all.scrollHeight,
    before_px: box(before).top + scrollY,
    wider_px: Math.max(all.scrollWidth, document.body.scrollWidth) - all.clientWidth,
    cut: parts.filter(isCut).length + boxes.filter(isClipped).length
      + words.filter((word) => cutOff(box(word), box(word.closest("svg")))).length,
    first_words: document.querySelector("header.first").textContent.trim().split(/\\s+/).length,
    words: text.textContent.trim().split(/\\s+/).length,
  };
}"""


def main(out: Annotated[Path, Option(help="where the run folder goes")] = Path("reports")) -> list[Row]:
    path = (out / "paper-trial").resolve()
    wanted = ("--set", "output.pictures=true")
    run_program(["-m", "sealtwin", "run", str(FIXTURE / "trial.toml"), *wanted, "--device", "cpu", "--out", str(path)])
    with tempfile.TemporaryDirectory() as place:
        copy = Path(place) / "run"
        shutil.copytree(path, copy)
        made = [_make(copy) for _ in range(REPORTS)]
        pages = [page.extract_text() for page in PdfReader(copy / "report.pdf").pages]
        seen = {width_px: _seen(copy / "report.html", width_px) for width_px in (DESK_PX, PHONE_PX)}
        sizes_mb = [(name, (copy / file).stat().st_size / 1e6) for name, file in FILES.items()]
    spread = ", ".join(f"{seconds:.1f}" for seconds in sorted(made))
    print(f"{platform.platform()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}; processor's times {spread} s")
    rows = [
        Row("a report, median of the processor's time", statistics.median(made), "s", 0, LONGEST_S),
        *(Row(name, size_mb, "MB", 0, LARGEST_MB) for name, size_mb in sizes_mb),
    ]
    for width_px, longest_px in ((DESK_PX, 8_000), (PHONE_PX, 14_000)):
        where = f"{width_px} px wide"
        rows += [
            Row(f"page before its appendix, {where}", seen[width_px]["before_px"], "px", 0, longest_px),
            Row(f"whole page, {where}", seen[width_px]["height_px"], "px"),
            Row(f"cut pictures, their words, tables, {where}", seen[width_px]["cut"], "", 0, 0),
            Row(f"page beyond its window, {where}", seen[width_px]["wider_px"], "px", 0, 0),
        ]
    return [
        *rows,
        Row("words of the page before its first figure", seen[DESK_PX]["first_words"], "", 0, MOST_FIRST_WORDS),
        Row("words of the page before its appendix", seen[DESK_PX]["words"], "", 0, MOST_WORDS),
        Row("pages of the PDF", len(pages), "", 0, MOST_PAGES),
        Row("the PDF's first page has the first figure alone", pages[0].count("Figure "), "", 1, 1),
    ]


def _seen(page: Path, width_px: int) -> dict[str, float]:
    """Heights, words and cut parts of a page in a window of that width, without its scripts."""
    executable = shutil.which("chromium")
    if executable is None:
        raise SystemExit("no chromium on the PATH; 'make test-browser' installs it")
    playwright: Any = importlib.import_module("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=executable, args=["--no-sandbox", "--disable-gpu"])
        shown = browser.new_page(viewport={"width": width_px, "height": 900})
        shown.goto(page.resolve().as_uri())
        return {name: float(value) for name, value in shown.evaluate(LOOK).items()}


def _make(folder: Path) -> float:
    """Make the report anew; return its processor time in s."""
    with open_folder(folder, create=False) as run:
        run.clear("validate")
    return run_program(["-m", "sealtwin", "validate", str(folder), "--quiet"]).processor_s


if __name__ == "__main__":
    run_benchmark(main)
