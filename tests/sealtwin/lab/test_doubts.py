"""A sheet that may not say what was meant holds its sample until one line of its note answers."""

import json

import pytest

from sealtwin.core.errors import InputError
from sealtwin.lab.ingest import ingest
from sealtwin.trial.trial_file import load_trial
from tests.labs import QUIET, sealtwin
from validate.readings.read_readings import read_readings


@pytest.fixture
def doubtful(small):
    """The small folder, with a 0 for a missing reading of P01 in cell C4, and its answer not given."""
    sheet = small / "P01.csv"
    lines = sheet.read_text().splitlines()
    cells = lines[3].split(",")
    lines[3] = ",".join([cells[0], cells[1], "0.00", cells[3]])
    sheet.write_text("\n".join(lines) + "\n")
    return small


def fates(ingested):
    return {outcome.sample.name: outcome.fate for outcome in ingested.outcomes}


def test_a_doubt_holds_its_sample_alone_and_names_cell_and_answer(doubtful, tmp_path):
    ingested = ingest(doubtful, tmp_path / "lab", QUIET)
    assert fates(ingested) == {"P01": "failed", "P02": "new"}
    (fault,) = ingested.faults
    assert fault.sentence.startswith("P01.csv, line 4, column level_2_mm, cell C4: 0 mm at s = 5 mm")
    assert 'readings.as_written = ["C4"]' in fault.sentence
    assert "P01.toml" in fault.sentence
    assert not (tmp_path / "lab" / "P01").exists()


@pytest.mark.parametrize("answer", ['readings.as_written = ["C4"]\n', 'readings.as_written = ["B2", "C4"]\n'])
def test_one_line_of_its_note_takes_the_sample_in_as_written(doubtful, tmp_path, answer):
    note = doubtful / "P01.toml"
    note.write_text(answer + note.read_text())
    ingested = ingest(doubtful, tmp_path / "lab", QUIET)
    assert fates(ingested) == {"P01": "new", "P02": "new"}
    trial = load_trial(tmp_path / "lab" / "P01" / "trial.toml")
    assert trial.readings is not None
    assert "C4" in (trial.readings.as_written or ())
    profile = read_readings(tmp_path / "lab" / "P01" / trial.readings.file, trial.readings, None, 8.0)
    assert profile.repeats_mm is not None
    assert profile.repeats_mm[2, 1] == 0.0
    assert profile.doubts == ()


def test_another_cells_answer_answers_nothing(doubtful, tmp_path):
    note = doubtful / "P01.toml"
    note.write_text('readings.as_written = ["C5"]\n' + note.read_text())
    assert fates(ingest(doubtful, tmp_path / "lab", QUIET))["P01"] == "failed"


@pytest.mark.parametrize("line", ["wie geschrieben;C4", "readings.as_written;['C4']", "as written;C4, B7"])
def test_a_note_in_words_answers_too(small, tmp_path, line):
    sheet = small / "P02_Messung.csv"
    lines = sheet.read_text(encoding="utf-8-sig").splitlines()
    cells = lines[3].split(";")
    lines[3] = ";".join([cells[0], cells[1], "0,00", cells[3]])
    sheet.write_text("\n".join(lines) + "\n", encoding="utf-8-sig")
    (fault,) = ingest(small, tmp_path / "lab", QUIET).faults
    assert 'readings.as_written = ["C4"]' in fault.sentence
    assert "P02_Notiz.csv" in fault.sentence
    with (small / "P02_Notiz.csv").open("a", encoding="cp1252") as note:
        note.write(f"{line}\n")
    assert fates(ingest(small, tmp_path / "lab", QUIET)) == {"P01": "unchanged", "P02": "new"}


@pytest.mark.parametrize("answer", ['["c4"]', '["all"]', '"C4"', "[4]"])
def test_an_answer_is_a_cell_a_row_a_column_or_a_word(doubtful, tmp_path, answer):
    note = doubtful / "P01.toml"
    note.write_text(f"readings.as_written = {answer}\n" + note.read_text())
    sentences = [fault.sentence for fault in ingest(doubtful, tmp_path / "lab", QUIET).faults]
    assert any("readings.as_written" in sentence and "P01.toml" in sentence for sentence in sentences)


def test_no_answer_holds_for_all_samples(doubtful, tmp_path):
    lab = doubtful / "lab.toml"
    lab.write_text('readings.as_written = ["C4"]\n' + lab.read_text().replace("[readings]\n", "[gate_]\n", 0))
    with pytest.raises(InputError):
        ingest(doubtful, tmp_path / "lab", QUIET)


def test_the_readings_are_judged_again_by_the_volume_in_the_traced_crack(small, tmp_path):
    """0.08 ml fill a third of the crack, and levels 1.5 mm below its face most of it."""
    rows = (f"{s_mm},-1.5{s_mm},-1.4{13 - s_mm}" for s_mm in (0, 3, 5, 8, 11, 13))
    (small / "P01.csv").write_text("\n".join(["s_mm,level_1_mm,level_2_mm", *rows]))
    answer = sealtwin("ingest", small, "--out", tmp_path / "lab", "--json")
    (doubt,) = json.loads(answer.stdout)["traced"]["faults"]
    assert doubt["name"] == "P01"
    assert 'readings.as_written = ["datum"]' in doubt["sentence"]
    assert answer.exit_code == 6
