"""What a file's name says of a sample."""

from pathlib import PurePath

import pytest

from sealtwin.lab.found_files import read_name
from validate.readings.samples import sample_key

SPELLINGS = (
    ("P01.jpg", "photo"),
    ("p-01_top.JPEG", "photo"),
    ("photos/P 01.png", "photo"),
    ("Fotos/P01 Draufsicht.png", "photo"),
    ("P01_Foto.tif", "photo"),
    ("P01/IMG_2041.jpg", "photo"),
    ("P01/P01.webp", "photo"),
    ("P01_mask.png", "mask"),
    ("masks/P01.png", "mask"),
    ("P01_second_photo.jpg", "second_photo"),
    ("P01.csv", "readings"),
    ("p.01 Messung.xlsx", "readings"),
    ("caliper/P01.txt", "readings"),
    ("P01/Messwerte.tsv", "readings"),
    ("Tiefen P01.csv", "readings"),
    ("P01 mesures.txt", "readings"),
    ("Relevés/P01.csv", "readings"),
    ("P01_profondeur.csv", "readings"),
    ("P01 lecturas.xlsx", "readings"),
    ("Höhen P01.csv", "readings"),
    ("P01_Pegel.csv", "readings"),
    ("P01.toml", "note"),
    ("P01 observaciones.csv", "note"),
    ("P01_notes.csv", "note"),
    ("Protokolle/P01.xlsx", "note"),
    ("P01/Notiz.csv", "note"),
)


@pytest.mark.parametrize(("name", "role"), SPELLINGS)
def test_one_sample_however_its_files_are_named(name, role):
    said = read_name(PurePath(name))
    assert said is not None
    assert (sample_key(said.sample), said.role) == ("p01", role)


@pytest.mark.parametrize(
    ("one", "other"),
    [("May/P01.jpg", "June/P01.jpg"), ("1-11.jpg", "11-1.jpg"), ("P01.jpg", "P1.jpg"), ("P01_2.csv", "P01.csv")],
)
def test_what_may_be_two_samples_is_two(one, other):
    keys = [sample_key(said.sample) for name in (one, other) if (said := read_name(PurePath(name))) is not None]
    assert len(set(keys)) == 2


@pytest.mark.parametrize("name", ["report.pdf", "P01", "P01.docx", "P01.stl"])
def test_other_files_are_no_part_of_a_sample(name):
    assert read_name(PurePath(name)) is None


def test_a_name_with_markup_or_mathtext_becomes_a_plain_label():
    said = read_name(PurePath("<b onload=x>P$_{1}$.png"))
    assert said is not None
    assert not set(said.sample) & set("<>$={}&\"'/\\")


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("IMG_0412_P4.jpg", "p4"),
        ("P4 readings.xlsx", "p4"),
        ("P4-IMG_0412.jpg", "p4"),
        ("20260503_142233_P4.jpg", "p4"),
        ("P-03 (von oben).jpg", "p03"),
        ("P-03.csv", "p03"),
        ("IMG_0412.jpg", "img0412"),
    ],
)
def test_a_cameras_name_and_a_remark_are_taken_off_a_samples(name, key):
    said = read_name(PurePath(name))
    assert said is not None
    assert sample_key(said.sample) == key
