"""Weighings of a trial: the steps of a fill, and the mass of the sealant."""

from math import hypot
from pathlib import Path

import numpy as np
import pytest

from sealtwin.core import record_files
from sealtwin.core.errors import InputError, present
from sealtwin.core.files import read_json
from sealtwin.core.progress import Progress
from sealtwin.study.perturbed_inputs import Base, moved_sample
from sealtwin.study.pipeline import run_trial
from sealtwin.study.uncertainty_runs import _variants
from sealtwin.trial.trial_file import load_trial
from sealtwin.trial.validate_stage import varied_settings
from tests.support.processes import refusal
from tests.support.tiny_study import TRIAL, job_in, run_tiny, tiny_lab

QUIET = Progress()
DECLARED = "\n[uncertainty]\nwidth_mm = 0.1\ndepth_mm = 0.3\n"
FILL = "mass_g,level_mm\n0.109,-4\n0.174,-2\n0.246,0\n"


def lab_with(folder: Path, fill: str = FILL, crack: str = 'fill = "fill.csv"', more: str = DECLARED) -> Path:
    """Return the trial of a tiny lab whose crack flares, with a fill beside it."""
    trial = tiny_lab(folder).parent / "trial.toml"
    head, rest = trial.read_text(encoding="utf-8").split("[crack]\n")
    rest = rest[rest.index("[path]") :]
    text = f'{head}[crack]\ndepth_mm = 8.0\ntilt = "flare"\n{crack}\n{rest}{more}\n[output]\nsnapshots_s = []\n'
    trial.write_text(text, encoding="utf-8")
    (folder / "fill.csv").write_text(fill, encoding="utf-8")
    return trial


def run(trial: Path, out: Path, *stages) -> tuple[str, ...]:
    return run_trial(load_trial(trial), trial, out, stages or ("digitise",), "cpu", QUIET).redone


def test_a_weighed_fill_determines_depth_and_wall_angle_of_the_solid(tmp_path):
    trial, out = lab_with(tmp_path), tmp_path / "out"
    assert run(trial, out) == ("digitise",)
    recorded = read_json(out / "solid.json")
    weighed, volume_95_mm3 = recorded["weighed"], recorded["cavity_volume_95_mm3"]
    assert recorded["wall_angles_deg"] == pytest.approx([weighed["wall_angle_deg"]] * 2)
    assert recorded["depth_mm"] == pytest.approx(weighed["depth_mm"])
    assert volume_95_mm3[0] < recorded["cavity_volume_mm3"] < volume_95_mm3[1]
    assert record_files.read_solid(out).figures.weighed is not None
    fill = present(present(load_trial(out / "trial.toml").crack, "crack").fill, "fill")
    assert fill.mass_g == (0.109, 0.174, 0.246)
    # The content of the fill counts, not its name, and so do the uncertainties of width and depth.
    (tmp_path / "fill.csv").rename(tmp_path / "renamed.csv")
    text = trial.read_text(encoding="utf-8").replace("fill.csv", "renamed.csv")
    trial.write_text(text, encoding="utf-8")
    assert run(trial, out) == ()
    trial.write_text(text.replace("width_mm = 0.1", "width_mm = 0.2"), encoding="utf-8")
    assert run(trial, out) == ("digitise",)
    (tmp_path / "renamed.csv").write_text(FILL.replace("0.246", "0.25"), encoding="utf-8")
    assert run(trial, out) == ("digitise",)


@pytest.mark.parametrize(
    ("fill", "place"),
    [
        ("mass_g,level_mm\n0.06,-4\nmuch,-2\n", "fill.csv, row 3, column mass_g: 'much'"),
        ("mass_g,level_mm\n0.06,-4\n0.05,-2\n", "fill.csv, row 3, column mass_g: 0.05"),
        ("mass_g;level_mm\n1.000,06;-4\n", "fill.csv, row 2, column mass_g: '1.000,06'"),
    ],
)
def test_the_error_for_an_invalid_row_of_a_fill_names_row_and_column(tmp_path, fill, place):
    assert place in refusal("run", lab_with(tmp_path, fill), "--out", tmp_path / "out")


@pytest.mark.parametrize(
    ("crack", "more", "key"),
    [
        ('fill = "fill.csv"\nwall_angle_deg = 5.5', DECLARED, "wall_angle_deg cannot be combined with fill"),
        (
            'fill = "fill.csv"',
            f"{DECLARED}wall_angle_deg = 1.0\n",
            "follows from crack.fill, so they cannot be combined",
        ),
        ("[crack.fill]\nmass_g = [1.0]", DECLARED, "crack.fill: give file"),
        ('[crack.fill]\nfile = "fill.csv"\ndensity_kg_m3 = 1.0', DECLARED, "crack.fill.density_kg_m3 = 1.0"),
    ],
)
def test_settings_that_contradict_a_fill_are_refused(tmp_path, crack, more, key):
    with pytest.raises(InputError, match=key):
        load_trial(lab_with(tmp_path, crack=crack, more=more))


def test_extra_runs_of_a_weighed_fill_vary_width_angle_and_depth_together(tmp_path):
    exact = '[crack.fill]\nfile = "fill.csv"\nsurface_tension_n_m = 0\n'
    exact += "mass_sd_g = 0.002\nlevel_sd_mm = 0.05\nflush_sd_mm = 0.05"
    trial, out = lab_with(tmp_path, crack=exact), tmp_path / "out"
    text = trial.read_text(encoding="utf-8").replace("radius_mm = 0.45", "radius_mm = 0.36")
    trial.write_text(text, encoding="utf-8")
    run(trial, out, "digitise", "simulate")
    with job_in(out) as job:
        base = Base.of(job)
        variants = _variants(base, designed=True)
    weighed = present(base.sample.solid.figures.weighed, "weighed")
    names = ("width_mm", "wall_angle_deg", "depth_mm")
    root = np.array(weighed.steps)
    assert [base.inputs[name] for name in names] == pytest.approx(root.diagonal())
    moved = [(steps, bench) for steps, _, bench in variants if "width_mm" in steps]
    assert len(moved) >= 4
    for steps, bench in moved:
        by_mm, by_deg, deeper_mm = root @ [steps[name] / base.inputs[name] for name in names]
        assert bench.outline.mean_width_mm - base.sample.outline.mean_width_mm == pytest.approx(by_mm, abs=1e-6)
        assert bench.solid.wall_angles_deg[0] - weighed.wall_angle_deg == pytest.approx(by_deg, abs=1e-6)
        assert bench.solid.depth_mm - weighed.depth_mm == pytest.approx(deeper_mm, abs=1e-6)


WEIGHT = {"mass_g": 0.11, "mass_sd_g": 0.0055, "density_kg_m3": 1100.0, "density_sd_kg_m3": 22.0}
TEXT = TRIAL.replace("volume_ml = 0.08\n", "").replace("[solver]", '[solver]\nmodel = "slot"')
PASTE = 'viscosity_pa_s = 0.05\ndensity_kg_m3 = 1100\nfreeze_after_s = "never"'
TEXT = (
    TEXT.replace("U = 30.0\nD_cm = 0.3\nfreeze_after_s = 0.2", PASTE)
    + "\n[path.weighed]\n"
    + "".join(f"{key} = {value:g}\n" for key, value in WEIGHT.items())
)


def test_the_dispensed_volume_is_the_weighed_mass_over_the_density(tmp_path):
    with job_in(run_tiny(tmp_path, TEXT)) as job:
        # The folder's own trial has the volume beside the mass that it follows from.
        base = Base.of(job)
    assert base.sample.trajectory.dispensed_mm3 == pytest.approx(100.0)
    assert base.inputs == {"volume_ml": pytest.approx(0.1 * hypot(0.05, 0.02))}
    assert moved_sample(base, {"volume_ml": 0.01}).trajectory.dispensed_mm3 == pytest.approx(110.0)
    # Other weighings invalidate the extra runs, though the path is unchanged.
    other = base.changed({"path.weighed": {**WEIGHT, "mass_sd_g": 0.01}})
    assert varied_settings(other) != varied_settings(job.trial)


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("speed_mm_s = 20\n", "speed_mm_s = 20\nvolume_ml = 0.09\n", "volume_ml cannot be combined with weighed"),
        (
            "[path.weighed]",
            "[uncertainty]\nvolume_ml = 0.1\n[path.weighed]",
            "uncertainty.volume_ml follows from path.weighed, so they cannot be combined",
        ),
        ("mass_g = 0.11\n", "mass_g = 0.000011\n", r"weighed is 1e-05 ml"),
    ],
)
def test_settings_that_contradict_a_weighed_mass_are_refused(tmp_path, old, new, named):
    assert old in TEXT
    (tmp_path / "trial.toml").write_text(TEXT.replace(old, new))
    with pytest.raises(InputError, match=named):
        load_trial(tmp_path / "trial.toml")


def test_a_sealant_with_two_densities_is_refused(tmp_path):
    other = load_trial(run_trial_text(tmp_path, TEXT.replace(PASTE, PASTE.replace("1100", "1690"))))
    with pytest.raises(InputError, match=r"path.weighed.density_kg_m3 is 1100 and fluid.density_kg_m3 is 1690"):
        other.loaded(tmp_path)


def run_trial_text(folder: Path, text: str) -> Path:
    (folder / "trial.toml").write_text(text)
    return folder / "trial.toml"
