"""Hostile folders: links, control characters, spreadsheet formulas, huge files and damaged catalogues."""

import os
from dataclasses import replace

import pytest

from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.core.errors import InputError
from sealtwin.lab import files as lab_files
from sealtwin.lab import sample as samples
from sealtwin.lab.catalogue import CATALOGUE, write_table
from sealtwin.lab.files import CatalogueFault
from sealtwin.lab.ingest import ingest
from tests.support.ingested_lab import QUIET, fates
from tests.support.photos import mortar, write_png


def test_symbolic_links_are_not_followed(small, tmp_path):
    """A sample whose photo or sheet is a link fails."""
    secret = write_png(tmp_path / "secret.png", mortar((200, 200)))
    (small / "P02_Messung.csv").rename(tmp_path / "elsewhere.csv")
    for name, target in (("P03.png", secret), ("loop", small), ("P02_Messung.csv", tmp_path / "elsewhere.csv")):
        (small / name).symlink_to(target)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    sentences = {fault.sentence for fault in ingested.faults}
    for name in ("P03.png", "P02_Messung.csv"):
        assert f"{name}: this is a link or not a plain file. Replace it by a copy of the file." in sentences
    assert fates(ingested) == {"P01": "new", "P02": "failed", "P03": "failed"}


def test_control_characters_of_names_and_settings_are_not_printed(small, sound, tmp_path):
    for name in ("P03\n.png", "P04\x1b[2J.png", "P05\u202egnp.png"):
        (small / name).touch()
    (small / os.fsdecode(b"P06\xff.png")).touch()
    text = (small / "lab.toml").read_text().replace("A. Muster", "\\u001b[2J")
    (small / "lab.toml").write_text('note = "\\u202e"\n' + text)
    (small / "P02 Messung\x9b.csv").write_bytes(b"8 mm \x1b[2J\n\x1b]0;x\n")
    text = "\n".join(ingest_answer(ingest(small, tmp_path / "lab", QUIET)).lines)
    for words in ("P03?.png, ", ": the name has characters", "\\xff"):
        assert words in text
    assert not set(text) & {"\x1b", "\u202e", "\udcff", "\x9b"}
    faulty = replace(sound[3], lost=[CatalogueFault("P01.csv", "\x1b[2J\n\u202e")])
    assert "failed: P01.csv: ?[2J??" in ingest_answer(faulty).lines


def test_spreadsheet_formulas_in_names_and_settings_are_written_as_text(small, tmp_path):
    (small / "P01.png").rename(small / "=cmd()_P01_photo.png")
    text = (small / "lab.toml").read_text()
    (small / "lab.toml").write_text(text.replace('"A. Muster"', "'=HYPERLINK(\"x\")'"))
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    assert "\n'=cmd()_P01_photo.png,photo," in (lab / "pairing.csv").read_text()
    assert "\"'=HYPERLINK(" in (lab / "catalogue.csv").read_text()
    with (lab / "pairing.csv").open("a") as pairing:
        pairing.write("\n")  # Edited, so that its own cells are read back
    assert not ingest(small, lab, QUIET).lost


def test_a_sheet_of_1_gigabyte_is_refused_without_being_read(small, tmp_path, monkeypatch):
    with (small / "P01.csv").open("wb") as sheet:
        sheet.truncate(1_000_000_000)
    monkeypatch.setattr(
        samples.files, "sha256", lambda path: pytest.fail(str(path)) if path.stat().st_size > 1e8 else "x"
    )
    ingested = ingest(small, tmp_path / "lab", QUIET, dry_run=True)
    assert [*ingested.samples[0].questions] == ["P01.csv: has 1,000 MB, but at most 5 MB are allowed."]


def test_a_folder_with_too_many_files_is_refused(small, tmp_path, monkeypatch):
    monkeypatch.setattr(lab_files, "MAX_ENTRIES", 4)
    with pytest.raises(InputError, match=r"has more than 4 files\. Give parts of it one by one"):
        ingest(small, tmp_path / "lab", QUIET)


@pytest.mark.parametrize("damage", [b"no JSON", b'{"version": 99}', b"[]"])
def test_a_damaged_catalogue_is_refused_with_a_remedy(small, lab, damage):
    (lab / CATALOGUE).write_bytes(damage)
    for use in (lambda: ingest(small, lab, QUIET), lambda: write_table(lab)):
        with pytest.raises(InputError, match=r"catalogue.json: .* Move this file elsewhere, and ingest the same"):
            use()
    (lab / CATALOGUE).unlink()
    with pytest.raises(InputError, match=r"is not a lab, since it has no catalogue.json"):
        write_table(lab)
    assert fates(ingest(small, lab, QUIET)) == {"P01": "unchanged", "P02": "unchanged"}  # as the remedy says
