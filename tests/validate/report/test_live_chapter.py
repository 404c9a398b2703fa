"""What stands beside the page's fast model: the report's readings, band and sentences, as text and finite numbers."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sealtwin.core.records import Profile
from tests.evidence import FAST_FILL, make_evidence
from tests.pages import leave_out_figures
from validate.compare import assess
from validate.report.live_chapter import MOST_PLACES, live_chapter
from validate.report.write_report import write_report
from validate.report_input import Evidence, LiveModel, LiveSlider, LiveWidth
from validate.settings import Readings, Uncertainty

HOSTILE = "</script><script>struck()</script><!-- \u2028 & '"
CELLS = {"floor_mm": [3.0, 3.0], "mouth_mm": [3.0, 3.0], "depth_mm": [10.0, 10.0], "slant": [2.0, 2.0]}
LIVE = LiveModel(
    s_mm=[10.0, 30.0],
    widths={0: LiveWidth.model_validate(CELLS | {"reach_mm": 5.0, "given_mm3": [0.0, 600.0]})},
    along=[0.0],
    into=1.0,
    paste={"density_kg_m3": 1690.0, "yield_stress_pa": 4.0},
    nozzle_mm=2.4,
    settle_s=0.0,
    path={"t_s": [0.0, 7.0], "s_mm": [5.0, 35.0], "z_mm": [3.0, 3.0]},
    after_s=0.0,
    sliders={"flow_mm3_s": LiveSlider(as_run=85.7, step=1.0, low=-50, high=50)},
    limits={"slope": (0.45, 2, HOSTILE), "above_mm": (2.5, 1, HOSTILE)},
    unknown=(HOSTILE,),
    trial=HOSTILE,
)


@pytest.fixture(scope="module")
def evidence(tmp_path_factory) -> Evidence:
    return make_evidence(tmp_path_factory.mktemp("live"), live=LIVE)


def content(evidence: Evidence, **changes: Any) -> Any:
    return live_chapter(replace(evidence, **changes))


def test_a_slot_run_is_the_fast_model_s_own_and_has_no_band(evidence):
    data = content(evidence, run=replace(evidence.run, fast_fill=FAST_FILL))
    assert not data["by_particles"]
    assert "no band" in data["sentences"][0]
    assert data["band"] is None
    assert data["above_mm3"] - evidence.run.particle_volume_mm3 == pytest.approx(FAST_FILL.above_face_mm3)


def test_the_band_holds_what_the_budget_knows_of_the_simulation(evidence):
    settings = Readings(file=Path("caliper.csv"), data="measured", role="held-out")
    assessed = assess(evidence, settings, Uncertainty(), None)
    assert assessed.uncertainty is not None
    some = np.full(len(assessed.uncertainty.stations.s_mm), 0.3)
    for parts, half_mm, words in (
        ({"numerics_mm": some}, 0.6, "includes numerics, for the settings as run"),
        (
            {"numerics_mm": some, "inputs_mm": some * 4 / 3},
            1.0,
            "includes numerics and inputs, for the settings as run",
        ),
    ):
        stations = assessed.uncertainty.stations.model_copy(update=parts)
        uncertainty = assessed.uncertainty.model_copy(update={"stations": stations})
        comparison = assessed.model_copy(update={"uncertainty": uncertainty})
        data = content(evidence, comparison=comparison)
        assert data["band"]["level_mm"] == pytest.approx([half_mm] * len(some))
        assert any(words in sentence for sentence in data["sentences"])


def test_lines_are_finite_and_bounded(evidence):
    s_mm = np.linspace(0, 40, 5001)
    level_mm = np.where(s_mm < 1, np.nan, -3.0)
    data = content(evidence, profile=Profile(s_mm, level_mm), readings=Profile(s_mm, level_mm))
    for name in ("as_run", "readings"):
        assert 0 < len(data[name]["s_mm"]) <= MOST_PLACES
        assert np.isfinite(data[name]["level_mm"]).all()
    json.dumps(data, allow_nan=False)


def test_the_page_has_the_model_s_data_as_text_and_its_scripts(evidence, tmp_path, monkeypatch):
    leave_out_figures(monkeypatch)
    write_report(tmp_path, evidence)
    with_live = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert HOSTILE not in with_live
    data = with_live.split('id="live-model">')[1].split("</script>")[0]
    assert json.loads(data)["trial"] == HOSTILE
    assert json.loads(data)["unknown"] == [HOSTILE]
    # The page lists reasons in this order, as the terminal does.
    assert list(json.loads(data)["limits"]) == ["slope", "above_mm"]
    assert with_live.count("<script>") == 3
