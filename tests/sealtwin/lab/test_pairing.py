"""Pairing: what names say beyond doubt is done, everything else is asked."""

from pathlib import PurePath

import pytest

from sealtwin.lab.found_files import FilePlace, Piece, read_names
from sealtwin.lab.pairing import pair, place_files


def _paired(*names, decided=None):
    named = {Piece(file): said for file, said in read_names(map(PurePath, names), "?").items()}
    samples = pair(place_files(named, decided or {}))
    return {sample.key: sample for sample in samples}


def _questions(*names, decided=None):
    return {key: sample.questions for key, sample in _paired(*names, decided=decided).items() if sample.questions}


def test_photo_sheet_and_note_of_one_name_are_one_sample():
    samples = _paired("a/P01_top.jpg", "a/p-01 Messung.csv", "a/P01.toml", "a/P02.jpg")
    assert {role: str(file) for role, file in samples["ap01"].files.items()} == {
        "photo": "a/P01_top.jpg",
        "readings": "a/p-01 Messung.csv",
        "note": "a/P01.toml",
    }
    assert samples["ap01"].name == "a-P01"
    assert not samples["ap01"].questions
    assert list(samples["ap02"].files) == ["photo"]


def test_two_of_a_kind_are_asked_about_and_neither_is_taken():
    samples = _paired("P01_before.jpg", "P01_after.jpg", "P01.csv")
    assert "photo" not in samples["p01"].files
    assert "2 files are its photo: P01_before.jpg, P01_after.jpg" in samples["p01"].questions[0]


def test_a_sheet_one_letter_off_is_asked_about_with_the_photos_that_lack_one():
    asked = _questions("P01.jpg", "P02.jpg", "P02.csv", "P0l.csv")
    assert list(asked) == ["p0l"], "a photo without a sheet is taken in; its answer makes a revision of it"
    assert "Is it of P01.jpg? If so, write one sample for both" in asked["p0l"][0]


def test_a_sheet_in_another_folder_than_its_photo_is_asked_about():
    assert "Is it of May/P01.jpg?" in _questions("May/P01.jpg", "Readings 2026/P01.csv")["2026p01"][0]


@pytest.mark.parametrize("name", ["p L06 depths.txt", "L06 readings FINAL v2.xlsx", "l06_misure.csv", "Serie/L06.csv"])
def test_a_sheet_with_other_words_about_a_photos_name_is_its_own(name):
    samples = _paired("L06.jpg", name, "L060.jpg", "L07.jpg", "L07.csv")
    assert not samples["l06"].questions
    assert str(samples["l06"].files["readings"]) == name


def test_a_photo_may_have_more_words_too():
    samples = _paired("Series A - T1.png", "T1 readings.csv", "DSC_0031 T2 overview.png", "T2_depthlog_final.csv")
    assert [sorted(sample.files) for sample in samples.values()] == [["photo", "readings"]] * 2
    assert len(_questions("Series A - T1.png", "Series B - T1.png", "T1.csv")) == 1


def test_of_words_about_a_name_none_is_guessed():
    """Numbers may be of another sample, a longer name may be meant, and a sheet in place of another is a question."""
    assert "Is it of P02.jpg" in " ".join(_questions("P02.jpg", "P02 links.jpg", "P02 rechts.csv")["p02rechts"])
    assert "p02alt" in _questions("P02.jpg", "P02.csv", "P02 alt.csv")
    assert "2 files are its readings" in " ".join(_questions("P02.jpg", "P02 vor.csv", "P02 kurz.csv")["p02"])


@pytest.mark.parametrize("name", ["P02 xyz 7.csv", "Labor 3 P02.csv"])
def test_a_sheet_with_more_words_than_its_photo_is_offered_for_it(name):
    asked = _questions("P02.jpg", name, "K07.jpg")
    assert "Is it of P02.jpg" in " ".join(question for questions in asked.values() for question in questions)


def test_of_several_photos_that_a_sheet_may_be_of_all_are_named():
    asked = _questions("P01.jpg", "P02.jpg", "P03.csv")
    assert list(asked) == ["p03"]
    assert "Is it of P02.jpg, P01.jpg?" in asked["p03"][0]


def test_samples_that_are_whole_may_have_nearly_one_name():
    assert not _questions("P01.jpg", "P01.csv", "P02.jpg", "P02.csv", "P03.jpg")


def test_a_folder_of_one_sample_names_it():
    named = read_names(map(PurePath, ("photo.jpg", "caliper.csv", "trial.toml")), "paper-trial")
    (sample,) = pair(place_files({Piece(file): said for file, said in named.items()}, {}))
    assert (sample.name, sample.questions, len(sample.files)) == ("paper-trial", (), 3)


def test_a_cameras_name_counts_where_a_note_bears_it_too():
    """Traced photos as they come from the camera are samples; beside a sheet of another name they are views of one."""
    assert list(_paired("May/IMG_2041.jpg", "May/IMG_2041.toml", "May/IMG_2042.jpg")) == ["mayimg2041", "mayimg2042"]
    assert "2 files are its photo" in _questions("P05/IMG_2041.jpg", "P05/IMG_2042.jpg", "P05/caliper.csv")["p05"][0]


def test_a_name_that_says_no_sample_is_asked_about():
    assert "its name gives no sample" in _questions("photo.jpg")[""][0]


def test_a_decision_of_the_user_counts_before_the_name():
    decided = {
        (PurePath("P0l.csv"), ""): FilePlace("P01", "readings"),
        (PurePath("P01_side.jpg"), ""): FilePlace("P01", "ignore"),
    }
    samples = _paired("P01_top.jpg", "P01_side.jpg", "P0l.csv", decided=decided)
    assert list(samples) == ["p01"]
    assert not samples["p01"].questions
    assert str(samples["p01"].files["readings"]) == "P0l.csv"
