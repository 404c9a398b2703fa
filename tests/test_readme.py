"""Commands, files and figures that README and documentation name are correct."""

import json
import os
import re
import shlex
import shutil
import subprocess

import pytest
from typer.exceptions import TyperException

from benchmarks.headline import BLOCK, FIGURES, PAGE, RESULTS, WITH_FIGURES, page, totals, with_figures
from benchmarks.results import counts
from tests import shown_output
from tests.support.paths import ROOT
from tests.support.processes import commands

PAGES = {page: (ROOT / page).read_text(encoding="utf-8") for page in shown_output.PAGES}
README = PAGES["README.md"]


def _sealtwin_commands(page: str) -> list[str]:
    """Return the commands of all shell blocks of a page, of blocks that are not run or not shown too."""
    blocks = [block for block in shown_output.blocks_of(shown_output.read_page(page)) if block.language == "sh"]
    lines = [line for block in blocks for line in block.commands]
    return [line for line in lines if line.split()[0] in {"sealtwin", ".venv/bin/sealtwin"}]


@pytest.mark.parametrize("page", PAGES)
def test_every_make_target_benchmark_and_fixture_on_a_page_exists(page):
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    assert set(re.findall(r"(?:^|`)make ([a-z-]+)", PAGES[page], flags=re.MULTILINE)) <= targets
    scripts = {name.replace(".", "/") + ".py" for name in re.findall(r"python -m (benchmarks\.\w+)", PAGES[page])}
    files = set(re.findall(r"\b(?:benchmarks/\w+\.py|fixtures/[\w./-]+)", PAGES[page]))
    assert not [name for name in files | scripts if not (ROOT / name).exists()]


def test_every_file_and_folder_named_in_the_readme_exists():
    named = set(re.findall(r"\]\(([^)#:]+)\)", README)) | set(re.findall(r"`((?:fixtures|reports)/[\w./-]+)`", README))
    assert not [name for name in named if not (ROOT / name).exists()]


@pytest.mark.parametrize("page", [page for page in PAGES if _sealtwin_commands(page)])
def test_every_sealtwin_command_on_a_page_is_valid(page):
    """Each command and option exists, and takes as many values as it is given."""
    every = commands()
    for line in _sealtwin_commands(page):
        name, *arguments = shlex.split(line)[1:]
        if name == "material":
            name = f"{name} {arguments.pop(0)}"
        assert name in every, line
        try:
            every[name].make_context(name, arguments)
        except TyperException as fault:
            pytest.fail(f"{line}\n{fault.message}")


@pytest.mark.slow
def test_make_demo_runs_in_a_copy_without_an_environment(tmp_path):
    """Nothing is installed at first; the demo installs what it needs and no development tool."""
    keep = shutil.ignore_patterns(".venv", ".git", "__pycache__", "reports", ".*_cache")
    shutil.copytree(ROOT, tmp_path / "clone", ignore=keep)
    environment = {name: value for name, value in os.environ.items() if name not in {"VIRTUAL_ENV", "PYTHONPATH"}}
    demo = subprocess.run(
        ["make", "demo"], cwd=tmp_path / "clone", env=environment, capture_output=True, text=True, check=False
    )
    assert demo.returncode == 0, demo.stderr
    assert "Report   reports/paper-trial/report.html" in demo.stdout
    assert not (tmp_path / "clone" / ".venv" / "bin" / "pytest").exists()


def test_figures_of_readme_and_results_page_equal_the_stored_results():
    """Figures that were copied by hand were once out of date."""
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    written = list[str]()
    for path in WITH_FIGURES:
        text = path.read_text(encoding="utf-8")
        assert with_figures(text, results) == text
        written += [name for _, name in BLOCK.findall(text)]
    assert set(written) == FIGURES.keys()
    figures = PAGE.read_text(encoding="utf-8")
    assert page(results) == figures
    assert len(figures.split()) <= 1200
    missed = [row["name"] for section in results.values() for row in section["rows"] if row["missed"]]
    assert all(name in figures for name in missed)
    assert len(README.splitlines()) <= 80
    assert len(README.split()) <= 700


def test_a_section_whose_code_changed_is_in_no_count():
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    for name, section in results.items():
        section["older"] = name != "solids"
    solids = results["solids"]["rows"]
    assert (
        totals(results)
        == f"{counts(solids)} targets are met, counting the 1 of {len(results)} sections whose code is unchanged."
    )
    sections = page(results).partition("## Sections")[2]
    assert [line.split(" | ")[1] for line in sections.splitlines()[4:]].count("older code") == len(results) - 1
