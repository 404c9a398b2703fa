"""Links, names and notes that would move a cursor, giants: nothing of them strikes, and each is told."""

import os
from dataclasses import replace

import pytest

from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.core.errors import InputError
from sealtwin.lab import found_files, sample_trials
from sealtwin.lab.catalogue import CATALOGUE, CatalogueFault, latest_trials
from sealtwin.lab.ingest import ingest
from sealtwin.lab.run_checks import check_runs
from tests.labs import QUIET, sealtwin
from tests.pictures import mortar, write_png


def test_links_are_not_followed(small, tmp_path):
    secret = write_png(tmp_path / "secret.png", mortar((200, 200)))
    (small / "P03.png").symlink_to(secret)
    (small / "loop").symlink_to(small)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    link, depth = (fault.sentence for fault in ingested.faults)
    assert link == "P03.png: not a plain file; links are not followed: copy the file itself."
    assert depth.startswith("crack.depth_mm is missing")
    assert not check_runs(ingested, small, QUIET)[1]
    assert [outcome.fate for outcome in ingested.outcomes] == ["new", "new", "failed"]


def test_names_that_would_move_a_terminals_cursor_are_left_out(small, tmp_path):
    for name in ("P03\n.png", "P04\x1b[2J.png", "P05\u202egnp.png"):
        (small / name).touch()
    (small / os.fsdecode(b"P06\xff.png")).touch()
    told = "\n".join(ingest_answer(ingest(small, tmp_path / "lab", QUIET)).lines)
    assert "P03?.png: a name with control characters" in told
    assert "\\xff" in told
    assert not set(told) & {"\x1b", "\u202e", "\udcff"}


def test_names_and_notes_that_are_formulas_stay_text_in_tables(small, tmp_path):
    (small / "P01.png").rename(small / "=cmd()_P01_photo.png")
    (small / "P02_Notiz.csv").write_text('Tiefe;8 mm\nPrüfer;"=HYPERLINK(""x"")"\n')
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    assert "\n'=cmd()_P01_photo.png,photo," in (lab / "pairing.csv").read_text()
    sealtwin("lab", "export", lab, "--out", tmp_path / "out.csv")
    assert "\"'=HYPERLINK(" in (tmp_path / "out.csv").read_text()
    assert not ingest(small, lab, QUIET, pairing=lab / "pairing.csv").left_out  # its own cells are read back


def test_a_note_that_would_move_a_terminals_cursor_moves_none(small, tmp_path):
    (small / "P01.toml").write_text(
        'operator = "\\u001b[2J"\nnote = "\\u202e"\ncrack.depth_mm = 8.0\n"\\u009b2J" = 1\n'
    )
    (small / "P02_Notiz.csv").write_bytes(b"Tiefe;8 mm\nBemerkung;\x1b[2J\n\x1b]0;x\n")
    told = "\n".join(ingest_answer(ingest(small, tmp_path / "lab", QUIET)).lines)
    assert "P01.toml" in told
    assert "P02_Notiz.csv" in told
    assert not set(told) & {"\x1b", "\u202e", "\x9b"}


def test_whatever_a_fault_quotes_moves_no_cursor(sound):
    told = ingest_answer(replace(sound[3], faults=(CatalogueFault("P01", "P01.csv: \x1b[2J\n\u202e"),))).lines
    assert "failed: P01: P01.csv: ?[2J??" in told


def test_a_sheet_of_a_gigabyte_is_refused_unread(small, tmp_path, monkeypatch):
    with (small / "P01.csv").open("wb") as sheet:
        sheet.truncate(1_000_000_000)
    monkeypatch.setattr(
        sample_trials.files, "sha256", lambda path: pytest.fail(str(path)) if path.stat().st_size > 1e8 else "x"
    )
    ingested = ingest(small, tmp_path / "lab", QUIET, dry_run=True)
    assert ingested.outcomes[0].faults == ["P01.csv: 1,000 MB; the limit for such a file is 5 MB."]


def test_a_note_that_cannot_be_read_is_the_one_fault(small, tmp_path):
    (small / "P01.toml").write_text("a." * 60_000 + "b = 1")
    (fault,) = ingest(small, tmp_path / "lab", QUIET).faults
    assert fault.sentence.startswith("P01.toml: a key of more than 16 parts")


def test_too_many_files_are_refused(small, tmp_path, monkeypatch):
    monkeypatch.setattr(found_files, "MOST_ENTRIES", 6)
    with pytest.raises(InputError, match="more than 6 files; give one part of it at a time"):
        ingest(small, tmp_path / "lab", QUIET)


def test_a_catalogue_that_is_none_is_told_of(small, tmp_path):
    lab = tmp_path / "lab"
    with pytest.raises(InputError, match=r"no lab \(it has no catalogue.json\)"):
        latest_trials(tmp_path)
    ingest(small, lab, QUIET)
    for damage in (b"no JSON", b'{"version": 99}', b"[]"):
        (lab / CATALOGUE).write_bytes(damage)
        for use in (lambda: ingest(small, lab, QUIET), lambda: latest_trials(lab)):
            with pytest.raises(InputError, match=r"catalogue.json: .* Move it away and ingest the same"):
                use()
    (lab / CATALOGUE).unlink()
    assert [outcome.fate for outcome in ingest(small, lab, QUIET).outcomes] == ["unchanged"] * 2  # as the remedy says


@pytest.mark.parametrize("name", ["", "  ", "P\\u202e1", "P\\n1"])
def test_a_name_that_cannot_be_seen_as_it_is_written_is_refused(small, tmp_path, name):
    (small / "P01.toml").write_text(f'name = "{name}"\n{(small / "P01.toml").read_text()}')
    (fault,) = ingest(small, tmp_path / "lab", QUIET).faults
    assert "must be a name: one line of visible letters" in fault.sentence


def test_a_lab_names_no_place_of_this_machine_and_moves_with_its_folder(small, tmp_path):
    lab = tmp_path / "lab"
    ingest(small, lab, QUIET)
    kept = [path for path in lab.rglob("*") if path.is_file()]
    assert len(kept) > 5
    assert not [path.name for path in kept if str(tmp_path).encode() in path.read_bytes()]
    (tmp_path / "moved").mkdir()
    both = [folder.rename(tmp_path / "moved" / folder.name) for folder in (small, lab)]
    assert {outcome.fate for outcome in ingest(both[0], both[1], QUIET).outcomes} == {"unchanged"}
