"""Notes: lab words, units and decimal signs become settings; what is not sure is a fault with its row."""

from datetime import datetime

import openpyxl
import pytest

from sealtwin.lab.note_words import BY_WORD, UNITS, known_keys
from sealtwin.lab.notes import Note, NoteEntry, read_defaults, read_note
from validate.readings.text_table import WORDS


def _written(folder, text, name="P01_notes.csv", encoding="utf-8"):
    path = folder / name
    path.write_bytes(text.encode(encoding))
    return read_note(path)


def _values(note):
    assert not note.faults
    return {key: entry.value for key, entry in note.entries.items()}


def test_every_word_means_one_setting_that_there_is():
    words = [word for setting in WORDS["notes"]["settings"].values() for word in setting.split(",")]
    assert len(words) == len(BY_WORD)  # none twice, spelt one way or another
    assert {meaning.key for meaning in BY_WORD.values()} <= known_keys()
    assert {meaning.unit for meaning in BY_WORD.values()} == UNITS.keys() | {""}
    assert WORDS["notes"]["choices"].keys() <= WORDS["notes"]["settings"].keys()


DEPTHS = (
    *("Tiefe [mm];16,0", "depth (cm);1,6", "Risstiefe in m;0,016", "TIEFE;16 mm", "Depth:;1.6 cm", "tiefe;16;mm"),
    *("crack.depth_mm;16,0", "Crack-Depth, mm;16", "Profondeur en mm;16,0", "Profundidad [cm];1,6"),
)


@pytest.mark.parametrize(
    ("row", "key", "value"),
    [
        *((row, "crack.depth_mm", 16.0) for row in DEPTHS),
        ("Maßstab;0,105 mm/px", "photo.mm_per_px", 0.105),
        ("mm je Bildpunkt;0,25", "photo.mm_per_px", 0.25),
        ("Maßstab;0,25 mm per pixel", "photo.mm_per_px", 0.25),
        ("Probengröße;160 x 40 mm", "photo.face_mm", [160.0, 40.0]),
        ("ends;12.5 340, 905 377", "photo.ends_px", [[12.5, 340.0], [905.0, 377.0]]),
        ("Vorschub;240 mm/min", "path.speed_mm_s", 4.0),
        ("viscosity;54 mPa·s", "fluid.viscosity_pa_s", 0.054),
        ("Dichte;1,69 g/cm³", "fluid.density_kg_m3", 1690.0),
        ("Zustand;ausgehärtet", "readings.state", "cured"),
        ("Bezug;Probenoberfläche", "readings.datum", "sample_surface"),
        ("use of readings;held-out", "readings.role", "held-out"),
        ("Prüfdatum;3.5.2026", "date", "2026-05-03"),
        ("Duesenhoehe;3 mm", "path.nozzle_height_mm", 3.0),
        ("Bemerkung;=SUM(A1), <b>", "note", "=SUM(A1), <b>"),
        ("Échelle;0,105 mm/px", "photo.mm_per_px", 0.105),
        ("Diamètre de la buse;2,4 mm", "nozzle.diameter_mm", 2.4),
        ("État;durci", "readings.state", "cured"),
        ("Uso de las lecturas;validación", "readings.role", "held-out"),
    ],
)
def test_lab_words_become_settings_in_their_unit(tmp_path, row, key, value):
    assert _values(_written(tmp_path, f"Angabe;Wert\n{row}\n", encoding="cp1252")) == {key: value}


def test_what_is_left_blank_or_not_known_is_not_values(tmp_path):
    assert _values(_written(tmp_path, "Tiefe;\nBearbeiter;k.A.\nMenge;n/a\nDatum;-\nPrüfer;M\n")) == {"operator": "M"}


@pytest.mark.parametrize(
    ("row", "says"),
    [
        ("Tiefe;16,0", "line 2, column 2: 'Tiefe' = '16,0' has no unit"),
        ("Tiefe [mm];1,234", "is ambiguous; write 1234 or 1.2340"),
        ("Tiefe [mm];1.234,5", "is not a number"),
        ("Tiefe [mm];1,6 cm", "has two units, mm after the word and cm after the value"),
        ("Tiefe [kg];16", "is in 'kg', which is not a unit of this setting; write one of mm, cm"),
        ("Datum;03/05/2026", "is not an unambiguous date"),
        ("Zustand;halb trocken", "is not allowed; write one of wet, cured"),
        ("Rissenden;12,5 340 905 377", "must be x and y of two places in pixels"),
        ("Tiefe [mm];16;links", "'links' is not a word, value or unit"),
        (";16", "'16' has no word"),
        ("Tiefe [mm];16\nRisstiefe [mm];17", "line 3: crack.depth_mm is also given in "),
        ("Menge;viel\nDatum;gestern\nTiefe;16", "P01_notes.csv, line 4"),
        ("path.trim_mm;[1, 2", "is not valid TOML"),
    ],
)
def test_what_would_have_to_be_guessed_is_a_fault_with_its_row(tmp_path, row, says):
    note = _written(tmp_path, f"Angabe;Wert\n{row}\n")
    assert len(note.faults) == row.count("\n") + 1 - ("also given" in says), "all are told at once"
    assert says in note.faults[-1]
    assert "P01_notes.csv" in note.faults[-1]


@pytest.mark.parametrize("row", ["Dicke [mm];40", "météo;pluie"])
def test_what_a_lab_writes_down_besides_is_remarked(tmp_path, row):
    note = _written(tmp_path, f"Tiefe [mm];16\n{row}\n")
    assert _values(note) == {"crack.depth_mm": 16.0}
    (remark,) = note.remarks
    assert f"P01_notes.csv, line 2: {row.partition(';')[0]!r} = {row.partition(';')[2]!r} is kept as a remark" in remark


@pytest.mark.parametrize(
    ("row", "key"), [("Pixelgröße;0,25 mm pro Pixel", "photo.mm_per_px"), ("Bandgeschw.;4 mm/s", "path.speed_mm_s")]
)
def test_a_word_that_may_be_a_setting_is_asked_about_and_answered_in_lab_toml(tmp_path, row, key):
    """Else lab.toml's, or the starter's, would be taken in its place without a word."""
    (fault,) = _written(tmp_path, f"{row}\n").faults
    word = row.partition(";")[0]
    assert f'may be {key}, but the word is unknown. Define it in lab.toml: [words] "{word}" = "{key}"' in fault
    (tmp_path / "lab.toml").write_text(f'[words]\n"{word}" = "ignore"\n')
    note = read_note(tmp_path / "P01_notes.csv", read_defaults(tmp_path / "lab.toml").words)
    assert not note.faults
    assert "kept as a remark" in note.remarks[0]
    (tmp_path / "lab.toml").write_text(f'[words]\n"{word}" = "operator"\n')
    note = read_note(tmp_path / "P01_notes.csv", read_defaults(tmp_path / "lab.toml").words)
    assert note.entries.keys() == {"operator"}


def test_toml_knows_the_trials_own_keys(tmp_path):
    text = 'data = "measured"\ndate = 2026-05-03\ncrack.depth_mm = 16\ndepht_mm = 3\n'
    note = _written(tmp_path, text + '[photo]\nmm_per_pixl = 0.1\n[mesh]\n[project]\nname = "A7"\n', "P01.toml")
    assert note.entries["date"].value == "2026-05-03"
    assert note.entries["crack.depth_mm"].value == 16
    assert len(note.remarks) == 2, "also of a table that is none of a trial's"
    assert "'depht_mm' = 3 is kept as a remark" in "\n".join(note.remarks)
    for key, fault in zip(("photo.mm_per_pixl", "mesh"), note.faults, strict=True):
        assert f"'{key}': no such key" in fault


def test_a_workbook_is_a_note_with_numbers_and_dates_as_excel_holds_them(tmp_path):
    book = openpyxl.Workbook()
    rows = {"Tiefe [mm]": 16.25, "Dichte [g/cm³]": 1.695, "solver.substeps": 2, "Datum": datetime(2026, 5, 3)}
    for row in rows.items():
        book.worksheets[0].append(row)
    book.save(tmp_path / "P01_notes.xlsx")
    values = _values(read_note(tmp_path / "P01_notes.xlsx"))
    assert isinstance(values.pop("solver.substeps"), int)
    assert values == {"crack.depth_mm": 16.25, "fluid.density_kg_m3": 1695.0, "date": "2026-05-03"}


def test_a_samples_own_scale_takes_the_place_of_the_folders_whatever_its_kind():
    folder = Note({key: NoteEntry(1.0, "lab.toml") for key in ("photo.mm_per_px", "crack.depth_mm", "fluid.U")})
    own = Note({key: NoteEntry(1.0, "P01.toml") for key in ("photo.face_mm", "fluid.viscosity_pa_s")})
    assert set(own.over(folder).entries) == {"photo.face_mm", "fluid.viscosity_pa_s", "crack.depth_mm"}
