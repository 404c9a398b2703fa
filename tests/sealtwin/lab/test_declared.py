"""What lab.toml and notes say of samples: taken, asked for, or refused in one sentence."""

import pytest

from sealtwin.core.errors import InputError, present
from sealtwin.lab.ingest import ingest
from sealtwin.trial.trial_file import load_trial
from tests.support.ingested_lab import QUIET, edit
from tests.support.lab_folder import NOTES

P01 = str(NOTES["P01"][1])
TRACED = 'name = "P01"\n[photo]\nfile = "{}"\ndata = "measured"\nmm_per_px = 0.1\n[crack]\ndepth_mm = 8.0\n'
"""A trial as 'sealtwin trace' writes it: it names its photo, which must be the one beside it."""


def test_all_faults_of_lab_toml_are_told_at_once_and_stop_all(small, tmp_path):
    faulty = 'data = "measured"\nname = "all"\n[photo]\nmm_per_pxl = 0.1\nscale = 2\n[readings]\nas_written = ["C4"]\n'
    (small / "lab.toml").write_text(faulty)
    with pytest.raises(InputError, match=r"lab\.toml: ") as refusal:
        ingest(small, tmp_path / "lab", QUIET)
    lines = str(refusal.value).splitlines()
    assert len(lines) == 3
    for words in ("photo.mm_per_pxl = '0.1': no such", "photo.scale = '2': no such", "as_written"):
        assert any(words in line for line in lines)


@pytest.mark.parametrize(
    ("fluid", "stress_pa", "viscosity_pa_s", "assumed"),
    [
        ("", 5.0, 0.3, True),
        ("[fluid]\nD_cm = 0.2\n", 5.0, 0.3, True),
        ("[fluid]\nU = 10.0\nD_cm = 0.3\nfreeze_after_s = 2.5\n", 0.0, None, False),
    ],
)
def test_what_is_not_said_of_the_fluid_is_the_starters(small, tmp_path, fluid, stress_pa, viscosity_pa_s, assumed):
    """What a lab says of its paste is never added to: an age of freezing already holds the slope."""
    lab_toml = (small / "lab.toml").read_text()
    before = lab_toml[lab_toml.index("[fluid]") : lab_toml.index("[solver]")]
    edit(small / "lab.toml", before, fluid)
    ingested = ingest(small, tmp_path / "lab", QUIET)
    trial = load_trial(tmp_path / "lab" / "P01" / "trial.toml")
    given = present(trial.fluid, "fluid")
    assert (given.yield_stress_pa, given.viscosity_pa_s) == (stress_pa, viscosity_pa_s)
    # Without a rest the jet, still falling, is read as a spike of the level.
    assert trial.solver.settle_s == 2.0
    assert any("fluid.yield_stress_pa = 5.0" in text for text in ingested.samples[0].remarks) is assumed
    assert ("fluid.yield_stress_pa = 5.0" in trial.note) is assumed, "which every report shows"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (TRACED.format("P02.png"), "photo.file = 'P02.png', but the sample's photo is P01.png"),
        (f'{P01}mask = "P01_mask.png"\n', "photo.mask = 'P01_mask.png', but the sample's mask is no file"),
        ("a." * 60_000 + "b = 1", "a dotted key has more than 16 parts"),
    ],
)
def test_a_note_that_contradicts_its_samples_files_or_cannot_be_is_the_one_fault(small, tmp_path, text, sentence):
    (small / "P02_Messung.csv").unlink()
    (small / "P01.toml").write_text(text)
    faults = [fault.sentence for fault in ingest(small, tmp_path / "lab", QUIET).faults]
    assert [f"P01.toml: {sentence}" in fault for fault in faults if "missing" not in fault] == [True]
