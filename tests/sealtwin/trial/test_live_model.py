"""What a report's page is given to compute the fill again; tests/browser/test_live_report.py has the page itself."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from digitise.settings import CrackShape, NozzlePath
from digitise.solid.build_solid import build_solid
from digitise.trajectory import plan_trajectory
from sealtwin.core.errors import present
from sealtwin.core.progress import Progress
from sealtwin.core.records import Outline
from sealtwin.core.run_folder import open_folder
from sealtwin.core.settings import checked
from sealtwin.trial.job import start_job
from sealtwin.trial.live_model import MOST_PLACES, live_model
from sealtwin.trial.trial_file import Trial
from tests.shapes import straight_slot
from validate.report_input import LiveModel

PASTE = {"viscosity_pa_s": 0.3, "yield_stress_pa": 4.0, "freeze_after_s": "never"}
LINE = 'x = "@"\n[photo] \u2028 </script> \\ "'


def modelled(tmp_path: Path, outline: Outline | None = None, **tables: object) -> LiveModel | None:
    """The model of a straight crack of 40 mm that a photo of 1 mm/px is said to show."""
    content = {
        "name": "x" * 80,
        "note": LINE,
        "photo": {"file": "crack.png", "data": "synthetic", "mm_per_px": 1.0},
        "crack": {"depth_mm": 16.0, "tilt": "flare"},
        "path": {"volume_ml": 1.2, "trim_mm": 6.0, "lead_out_mm": 4.0},
        "fluid": PASTE,
    }
    trial = checked(Trial, tmp_path / "trial.toml", {key: one for key, one in (content | tables).items() if one})
    outline, shape = outline or straight_slot(40.0), CrackShape(depth_mm=16.0, tilt="flare")
    solid = build_solid(outline, shape)
    trajectory = plan_trajectory(outline, trial.path, solid.cavity_volume_mm3, solid.sections)
    with open_folder(tmp_path / "run", create=True) as folder:
        job = start_job(trial, tmp_path, folder, "cpu", Progress())
        return live_model(job, outline, solid, trajectory)


def test_the_page_has_what_the_run_had_and_ranges_that_a_trial_may_have(tmp_path):
    model = present(modelled(tmp_path), "model")
    # 28 mm at 4 mm/s take 7 s; the lead of 4 mm takes one more, without sealant.
    assert model.path["t_s"][-1] == pytest.approx(7.0)
    assert model.after_s == pytest.approx(1.0)
    assert model.widths[0].given_mm3[-1] == pytest.approx(1200.0)
    assert model.sliders["flow_mm3_s"].as_run == pytest.approx(1200.0 / 7.0)
    for name, slider in model.sliders.items():
        assert slider.low < 0 < slider.high, name
        assert slider.as_run + slider.low * slider.step >= 0.0, name
    mean_mm = model.sliders["mean_width_mm"]
    assert sorted(model.widths) == list(range(mean_mm.low, mean_mm.high + 1))
    wider_mm = model.widths[1].floor_mm[30] - model.widths[0].floor_mm[30]
    assert wider_mm == pytest.approx(mean_mm.step, abs=2e-5)


def test_the_trial_file_is_completed_by_four_lines_and_nothing_in_its_texts_is_one(tmp_path):
    model = present(modelled(tmp_path), "model")
    lines = [line for line in model.trial.split("\n") if line.endswith(' = "@"')]
    assert lines == [f'{key} = "@"' for key in ("mean_width_mm", "volume_ml", "speed_mm_s", "yield_stress_pa")]
    text = model.trial.replace('"@"', "1.5")
    completed = checked(Trial, tmp_path / "trial.toml", tomllib.loads(text))
    assert (completed.note, len(completed.name)) == (LINE, 60 + len(" (changed)"))
    assert completed.photo is not None
    assert completed.photo.mean_width_mm == completed.path.speed_mm_s == 1.5


@pytest.mark.parametrize(
    "fluid", [{"freeze_after_s": 2.0}, {"structuration_pa_per_s": 0.1}, {"viscosity_pa_s": 0.0}, None]
)
def test_what_the_fast_model_cannot_do_has_no_chapter(tmp_path, fluid):
    assert modelled(tmp_path, fluid=fluid and PASTE | fluid) is None


def test_side_cracks_keep_their_width(tmp_path):
    model = present(modelled(tmp_path, replace(straight_slot(40.0), branches_kept=True)), "model")
    assert "mean_width_mm" not in model.sliders
    assert "mean_width_mm" not in model.trial
    assert list(model.widths) == [0]
    assert any("side cracks" in sentence for sentence in model.unknown)


def test_a_long_path_is_thinned(tmp_path):
    path = {"volume_ml": 1.2, "trim_mm": 6.0, "spacing_mm": 0.02}
    assert len(plan_trajectory(straight_slot(40.0), NozzlePath.model_validate(path)).t_s) > MOST_PLACES
    model = present(modelled(tmp_path, path=path), "model")
    assert len(model.path["t_s"]) == len(model.widths[0].given_mm3) == MOST_PLACES
    assert model.widths[0].given_mm3[-1] == pytest.approx(1200.0)


def test_the_page_says_what_the_crack_s_shape_hides_from_its_model(tmp_path):
    """A bar along half of the slot; the page, which computes no such reason, called it fit."""
    ring_mm = np.array([(10.0, -0.4), (10.0, 0.4), (30.0, 0.4), (30.0, -0.4)])
    model = present(modelled(tmp_path, replace(straight_slot(40.0), islands_mm=(ring_mm,))), "model")
    assert any(why.startswith("Stones,") for why in model.unknown)
