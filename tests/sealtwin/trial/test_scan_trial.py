"""A trial whose readings are a scan has the same record, page and intervals as one with caliper readings."""

import numpy as np
import pytest

from sealtwin.core import record_files
from sealtwin.core.errors import InputError, present
from sealtwin.core.files import read_json
from sealtwin.core.progress import Progress
from sealtwin.study.pipeline import run_trial
from sealtwin.trial.trial_file import load_trial
from tests.support.report_stubs import leave_out_figures
from tests.support.scan_beds import bed_of
from tests.support.tiny_study import TRIAL, tiny_lab
from validate.figures.first_figure import FirstFigure

FAST = TRIAL.replace("U = 30.0\nD_cm = 0.3\nfreeze_after_s = 0.2", 'viscosity_pa_s = 0.05\nfreeze_after_s = "never"')
FAST = FAST.replace("[solver]", '[solver]\nmodel = "slot"')
SCANNED = FAST[: FAST.index("[readings]")] + (
    '[readings]\nscan = "bed.xyz"\ndata = "synthetic"\nrole = "held-out"\n'
    '[readings.placement]\nunits = "mm"\nup = "z"\n'
    "points = [{name = 'a', scan = [0, 0, 0], sample_mm = [0, 0]},"
    " {name = 'b', scan = [30, 0, 0], sample_mm = [30, 0]}, {name = 'c', scan = [0, 20, 0], sample_mm = [0, 20]}]\n"
)


@pytest.fixture
def lab(tmp_path, monkeypatch):
    leave_out_figures(monkeypatch)
    tiny_lab(tmp_path)
    (tmp_path / "trial.toml").write_text(SCANNED)
    return tmp_path


def run(lab, stages=("digitise", "simulate", "validate")):
    return run_trial(load_trial(lab / "trial.toml"), lab / "trial.toml", lab / "out", stages, "cpu", Progress())


def test_a_trial_with_a_scan_is_compared_with_the_scanned_level(lab, monkeypatch):
    """The bed lies 1 mm above the simulated level, which is nearly flat."""
    (lab / "bed.xyz").write_text("0 0 0\n")
    run(lab, ("digitise", "simulate"))
    outline, simulated = record_files.read_outline(lab / "out"), record_files.read_profile(lab / "out")
    np.savetxt(lab / "bed.xyz", bed_of(outline, lambda s_mm: simulated.level_at_mm(s_mm) + 1.0, 0.2), fmt="%.4f")
    shown = []
    monkeypatch.setattr(FirstFigure, "_draw_deviation", lambda figure, axes, scan, *_: shown.append(scan))
    comparison = present(run(lab).result.comparison, "comparison")
    assert comparison.bias_mm == pytest.approx(-1.0, abs=0.1)
    off_mm = shown[0].deviation_mm(simulated.level_at_mm(shown[0].s_mm))[shown[0].bottom_mm < 0]
    assert np.nanmedian(off_mm) == pytest.approx(-1.0, abs=0.1)
    scan = present(comparison.scan, "scan")
    assert scan.mean_level_mm == pytest.approx(simulated.level_mm.mean() + 1.0, abs=0.15)
    parts = present(comparison.uncertainty, "uncertainty").budget.parts
    assert [part.name for part in parts] == ["position and noise of the scan"]
    rows = {table["title"]: dict(table["rows"]) for table in read_json(lab / "out" / "report.json")["tables"]}
    assert rows["Readings"]["placed by"].startswith("named points")
    assert (lab / "out" / "inputs" / "bed.xyz").is_file()


@pytest.mark.parametrize(
    ("before", "after", "cause"),
    [
        ('scan = "bed.xyz"', 'scan = "bed.xyz"\nfile = "caliper.csv"', "not both"),
        ("[readings.placement]", "[unknown]", "placement"),
        ('role = "held-out"', 'role = "held-out"\nquantity = "depth"', "quantity belongs to a sheet"),
        ("[readings]", "[uncertainty]\noperator_mm = 0.1\n[readings]", "operator_mm is an error of caliper readings"),
        ('"bed.xyz"', '"absent.ply"', "absent.ply: not found, but readings.scan names it"),
    ],
)
def test_settings_of_a_scan_that_contradict_each_other_are_refused(lab, before, after, cause):
    (lab / "trial.toml").write_text(SCANNED.replace(before, after))
    with pytest.raises(InputError, match=cause):
        run(lab)
