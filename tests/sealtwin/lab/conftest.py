"""A lab of ten sound samples, and a folder of two of them."""

import shutil

import pytest

from sealtwin.lab.ingest import ingest
from tests.lab_folder import make_lab_folder
from tests.labs import QUIET, hashes_of


@pytest.fixture(scope="session")
def sound(tmp_path_factory):
    """A lab's folder, its hashes before, and the lab that was made of it."""
    folder = make_lab_folder(tmp_path_factory.mktemp("sound") / "folder")
    before = hashes_of(folder)
    lab = folder.parent / "lab"
    return folder, before, lab, ingest(folder, lab, QUIET)


@pytest.fixture
def small(sound, tmp_path):
    """Two samples in a folder of their own."""
    whole = sound[0]
    folder = tmp_path / "folder"
    folder.mkdir()
    for name in ("lab.toml", "P01.png", "P01.csv", "P01.toml", "P02.png", "P02_Messung.csv", "P02_Notiz.csv"):
        shutil.copy(whole / name, folder)
    return folder
