"""A study of four tiny runs: its file, its folder before and after they are computed, and pages without pictures."""

import shutil
from dataclasses import replace

import pytest

from sealtwin.core.progress import Progress
from sealtwin.study.sweep import sweep
from tests.support.report_stubs import leave_out_figures
from tests.support.tiny_study import HERE, tiny_lab


@pytest.fixture(scope="session")
def lab(tmp_path_factory):
    """The study file of four tiny runs."""
    return tiny_lab(tmp_path_factory.mktemp("lab"))


@pytest.fixture(scope="session")
def prepared(lab, tmp_path_factory):
    """The folder of the study, digitised and planned, without runs."""
    out = tmp_path_factory.mktemp("prepared") / "out"
    sweep(lab, out, replace(HERE, dry_run=True), Progress())
    return out


@pytest.fixture(scope="session")
def unbroken(lab, prepared, tmp_path_factory):
    """The folder of the study with all runs, computed in this process without interruption."""
    out = shutil.copytree(prepared, tmp_path_factory.mktemp("unbroken") / "out")
    sweep(lab, out, HERE, Progress())
    return out


@pytest.fixture
def fresh(prepared, tmp_path):
    return shutil.copytree(prepared, tmp_path / "out")


@pytest.fixture
def done(unbroken, tmp_path):
    return shutil.copytree(unbroken, tmp_path / "out")


@pytest.fixture
def without_pictures(monkeypatch):
    leave_out_figures(monkeypatch)
