"""path.weighed: the sealant by its mass, in place of its volume and of the volume's uncertainty."""

from math import hypot
from pathlib import Path

import pytest

from sealtwin.core.errors import InputError
from sealtwin.study.moved_inputs import Base, moved_sample
from sealtwin.trial.trial_file import load_trial
from sealtwin.trial.validate_stage import varied_settings
from tests.support.tiny_study import TRIAL, job_in, run_tiny

WEIGHT = {"mass_g": 0.11, "mass_sd_g": 0.0055, "density_kg_m3": 1100.0, "density_sd_kg_m3": 22.0}
TEXT = TRIAL.replace("volume_ml = 0.08\n", "").replace("[solver]", '[solver]\nmodel = "slot"')
PASTE = 'viscosity_pa_s = 0.05\ndensity_kg_m3 = 1100\nfreeze_after_s = "never"'
TEXT = (
    TEXT.replace("U = 30.0\nD_cm = 0.3\nfreeze_after_s = 0.2", PASTE)
    + "\n[path.weighed]\n"
    + "".join(f"{key} = {value:g}\n" for key, value in WEIGHT.items())
)


def test_the_nozzle_gives_mass_over_density_with_the_doubt_of_both(tmp_path):
    with job_in(run_tiny(tmp_path, TEXT)) as job:
        # The folder's own trial has the volume beside the mass that it follows from.
        base = Base.of(job)
    assert base.sample.trajectory.dispensed_mm3 == pytest.approx(100.0)
    assert base.inputs == {"volume_ml": pytest.approx(0.1 * hypot(0.05, 0.02))}
    assert moved_sample(base, {"volume_ml": 0.01}).trajectory.dispensed_mm3 == pytest.approx(110.0)
    # Other weighings make the extra runs say nothing, though the path stays as it is.
    other = base.changed({"path.weighed": {**WEIGHT, "mass_sd_g": 0.01}})
    assert varied_settings(other) != varied_settings(job.trial)


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("speed_mm_s = 20\n", "speed_mm_s = 20\nvolume_ml = 0.09\n", "volume_ml cannot be combined with weighed"),
        (
            "[path.weighed]",
            "[uncertainty]\nvolume_ml = 0.1\n[path.weighed]",
            "uncertainty.volume_ml cannot be combined with path.weighed",
        ),
        ("mass_sd_g = 0.0055\n", "", "path.weighed.mass_sd_g"),
        ("mass_g = 0.11\n", "mass_g = 0.000011\n", r"weighed is 1e-05 ml"),
        ("density_kg_m3 = 1100", "density_kg_m3 = 1.1", "path.weighed.density_kg_m3"),
    ],
)
def test_what_contradicts_it_is_refused_by_name(tmp_path, old, new, named):
    assert old in TEXT
    (tmp_path / "trial.toml").write_text(TEXT.replace(old, new))
    with pytest.raises(InputError, match=named):
        load_trial(tmp_path / "trial.toml")


def test_one_sealant_has_one_density(tmp_path):
    other = load_trial(run_trial_text(tmp_path, TEXT.replace(PASTE, PASTE.replace("1100", "1690"))))
    with pytest.raises(InputError, match=r"path.weighed.density_kg_m3 is 1100 and fluid.density_kg_m3 is 1690"):
        other.loaded(tmp_path)


def run_trial_text(folder: Path, text: str) -> Path:
    (folder / "trial.toml").write_text(text)
    return folder / "trial.toml"
