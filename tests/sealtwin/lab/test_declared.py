"""What lab.toml and notes say of samples: taken, asked for, or refused in one sentence."""

from pathlib import Path

import pytest

from sealtwin.cli.folder_answer import ingest_answer
from sealtwin.core.errors import InputError
from sealtwin.core.record_files import read_outline, read_solid
from sealtwin.lab.ingest import ingest
from sealtwin.trial.trial_file import load_trial
from simulate.setup_checks import check_fit
from tests.labs import QUIET, sealtwin
from tests.pictures import mortar, with_crack, write_png


def test_a_fault_of_lab_toml_is_told_once_and_stops_all(small, tmp_path):
    (small / "lab.toml").write_text('data = "measured"\n[photo]\nmm_per_pxl = 0.1\n')
    with pytest.raises(InputError, match=r"lab\.toml: 'photo\.mm_per_pxl': no such key"):
        ingest(small, tmp_path / "lab", QUIET)
    (small / "lab.toml").write_text('data = "measured"\nname = "all"\n')
    with pytest.raises(InputError, match="name belongs to one sample"):
        ingest(small, tmp_path / "lab", QUIET)


def test_all_faults_of_lab_toml_are_told_at_once(small, tmp_path):
    (small / "lab.toml").write_text('data = "measured"\nname = "all"\n[photo]\nmm_per_pxl = 0.1\nscale = 2\n')
    with pytest.raises(InputError) as refusal:
        ingest(small, tmp_path / "lab", QUIET)
    told = str(refusal.value)
    for words in ("'photo.mm_per_pxl': no such key", "'photo.scale': no such key", "name belongs to one sample"):
        assert words in told
    assert len(told.splitlines()) == 3


def test_what_is_not_said_of_the_fluid_and_its_rest_is_the_starters(small, tmp_path):
    """Without a rest the jet, still falling, is read as a spike of the level."""
    lab_toml = (small / "lab.toml").read_text()
    ingest(small, tmp_path / "lab", QUIET)
    said = load_trial(tmp_path / "lab" / "P01" / "trial.toml")
    assert (said.solver.settle_s, said.fluid and said.fluid.freeze_after_s) == (2.0, 0.2)
    fluid = lab_toml[lab_toml.index("[fluid]") : lab_toml.index("[solver]")]
    (small / "lab.toml").write_text(lab_toml.replace(fluid, "").replace("[solver]\n", "[solver]\nsettle_s = 0.5\n"))
    ingested = ingest(small, tmp_path / "lab", QUIET)
    said = load_trial(tmp_path / "lab" / "P01" / "trial.toml")
    assert said.solver.settle_s == 0.5
    assert said.fluid is not None
    assert (said.fluid.yield_stress_pa, said.fluid.freeze_after_s) == (12.0, "never")
    assert any("fluid.yield_stress_pa = 12.0" in remark for remark in ingested.outcomes[0].remarks)
    assert "fluid.yield_stress_pa = 12.0" in said.note, "which every report shows"


def test_the_particles_of_a_thin_crack_fit_it_where_nobody_says_their_radius(small, tmp_path):
    """A radius of 0.4 mm in all of a lab's trials left its cracks of less than 1.6 mm without a run."""
    write_png(small / "P01.png", with_crack(mortar((200, 200)), [(40, 101), (80, 97), (120, 103), (160, 98)], 10))
    lab_toml = (small / "lab.toml").read_text()
    (small / "lab.toml").write_text(lab_toml.replace("radius_mm = 0.45\n", ""))
    ingest(small, tmp_path / "lab", QUIET)
    trial, run = load_trial(tmp_path / "lab" / "P01" / "trial.toml"), tmp_path / "run"
    assert sealtwin("digitise", tmp_path / "lab" / "P01" / "trial.toml", "--out", run).exit_code == 0
    outline, solid = read_outline(run), read_solid(run)
    assert 1.0 < outline.mean_width_mm < 1.3
    assert trial.fluid is not None
    check_fit(outline, solid, trial.fluid, trial.solver, trial.nozzle)
    assert trial.solver.for_crack(outline.mean_width_mm).size_mm == pytest.approx(outline.mean_width_mm / 8, rel=0.01)


@pytest.mark.parametrize(
    ("said", "stress_pa", "freeze", "remark"),
    [
        ("viscosity_pa_s = 0.05", 12.0, "never", "fluid.yield_stress_pa = 12.0"),
        ("U = 10.0\nyield_stress_pa = 20.0", 20.0, "never", 'fluid.freeze_after_s = "never"'),
        ("U = 10.0\nD_cm = 0.3\nfreeze_after_s = 2.5", 0.0, 2.5, None),
        (
            'U = 10.0\nD_cm = 0.3\nfreeze_after_s = "never"',
            0.0,
            "never",
            "without fluid.yield_stress_pa and fluid.freeze_after_s the sealant ends level",
        ),
    ],
)
def test_of_a_fluid_that_is_said_in_part_only_the_rest_is_the_starters(
    small, tmp_path, said, stress_pa, freeze, remark
):
    """What a lab says of its paste is never added to: an age of freezing already holds the slope."""
    lab_toml = (small / "lab.toml").read_text()
    fluid = lab_toml[lab_toml.index("[fluid]") : lab_toml.index("[solver]")]
    (small / "lab.toml").write_text(lab_toml.replace(fluid, f"[fluid]\n{said}\n"))
    ingested = ingest(small, tmp_path / "lab", QUIET)
    found = load_trial(tmp_path / "lab" / "P01" / "trial.toml").fluid
    assert found is not None
    assert (found.yield_stress_pa, found.freeze_after_s) == (stress_pa, freeze)
    assert found.D_cm == (None if "viscosity" in said else 0.3)
    remarks = [text for text in ingested.outcomes[0].remarks if "fluid" in text]
    assert remarks == [] if remark is None else remark in remarks[0]


def test_a_value_of_lab_toml_that_fails_all_samples_is_told_in_one_sentence(small, tmp_path):
    (small / "lab.toml").write_text((small / "lab.toml").read_text().replace("mm_per_px = 0.1", "mm_per_px = 100.0"))
    ingested = ingest(small, tmp_path / "lab", QUIET)
    assert ingest_answer(ingested).exit_code == 3
    assert [
        line
        for line in ingest_answer(ingested).lines
        if line.startswith("failed: P01, P02: lab.toml: photo.mm_per_px = 100.0")
    ]


def test_what_is_not_declared_is_asked_and_where_to_write_it(small, tmp_path):
    (small / "lab.toml").write_text("[photo]\nmm_per_px = 0.1\n")
    sentences = [fault.sentence for fault in ingest(small, tmp_path / "lab", QUIET).faults if fault.name == "P01"]
    assert len(sentences) == 3
    for key in ("photo.data", "readings.data", "readings.role"):
        assert any(sentence.startswith(f"{key} is missing") for sentence in sentences)
    told = [line for line in ingest_answer(ingest(small, tmp_path / "lab", QUIET)).lines if "is missing" in line]
    assert len(told) == 3, "of many samples once"
    assert told[0].startswith("failed: P01, P02: photo.data is missing")


def test_readings_that_a_note_speaks_of_must_be_there(small, tmp_path):
    (small / "P02_Messung.csv").unlink()
    assert not ingest(small, tmp_path / "lab", QUIET).faults  # of lab.toml's readings P02 has none
    (small / "P02_Notiz.csv").write_text("Tiefe;8 mm\nZustand;wet\n")
    (fault,) = ingest(small, tmp_path / "lab", QUIET).faults
    assert "P02_Notiz.csv, line 2: readings.state is given, but the sample has no readings" in fault.sentence


def test_a_traced_trial_beside_its_photo_is_its_note(small, tmp_path):
    """As 'sealtwin trace' writes it: it names its photo, which must be the one beside it."""
    text = 'name = "P01"\n[photo]\nfile = "P01.png"\ndata = "measured"\nmm_per_px = 0.1\n[crack]\ndepth_mm = 8.0\n'
    (small / "P01.toml").write_text(text)
    assert not ingest(small, tmp_path / "lab", QUIET).faults
    (small / "P01.toml").write_text(text.replace("P01.png", "P02.png"))
    (fault,) = ingest(small, tmp_path / "lab", QUIET).faults
    assert "P01.toml: photo.file = 'P02.png', but by its name P01.png belongs to this sample" in fault.sentence


def test_a_mask_is_its_samples_by_its_name_and_by_nothing_else(small, tmp_path):
    write_png(small / "P01_mask.png", mortar((200, 200)))
    note = (small / "P01.toml").read_text()
    (small / "P01.toml").write_text(f'{note}mask = "P01_mask.png"\n')
    assert not ingest(small, tmp_path / "lab", QUIET).faults
    trial = load_trial(tmp_path / "lab" / "P01" / "trial.toml")
    assert trial.photo is not None
    assert trial.photo.mask == Path("inputs/mask.png")
    (small / "P01_mask.png").rename(small / "drawn.dat")
    (fault,) = ingest(small, tmp_path / "lab", QUIET).faults
    assert "P01.toml: photo.mask = 'P01_mask.png', but by its name no mask belongs to this sample" in fault.sentence
