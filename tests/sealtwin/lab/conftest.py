"""A lab of ten samples without faults, a folder of two of them, and the lab of those two."""

import shutil

import pytest

from sealtwin.lab.ingest import ingest
from tests.support.ingested_lab import QUIET, hashes_of
from tests.support.lab_folder import make_lab_folder

TWO = "lab.toml", "P01.png", "P01.csv", "P02.png", "P02_Messung.csv"


@pytest.fixture(scope="session")
def sound(tmp_path_factory):
    """A lab's folder, its hashes before, and the lab that was made of it."""
    folder = make_lab_folder(tmp_path_factory.mktemp("sound") / "folder")
    before = hashes_of(folder)
    lab = folder.parent / "lab"
    return folder, before, lab, ingest(folder, lab, QUIET)


@pytest.fixture(scope="session")
def two(sound, tmp_path_factory):
    """The parent of ``folder``, which has two samples, and of ``lab``, the lab of this folder."""
    place = tmp_path_factory.mktemp("two")
    (place / "folder").mkdir()
    for name in TWO:
        shutil.copy(sound[0] / name, place / "folder")
    ingest(place / "folder", place / "lab", QUIET)
    return place


@pytest.fixture
def small(two, tmp_path):
    """A copy of the folder with two samples."""
    return shutil.copytree(two / "folder", tmp_path / "folder")


@pytest.fixture
def lab(two, small):
    """A copy of the lab of ``small``, beside that folder."""
    return shutil.copytree(two / "lab", small.parent / "lab")
