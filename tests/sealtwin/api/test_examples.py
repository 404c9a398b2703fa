"""Examples in the docstrings of the Python interface."""

import doctest
import inspect
import json
from pathlib import Path

import ezdxf.filemanagement
import numpy as np
import pytest
from ezdxf import units

import sealtwin as st
from sealtwin.api import studies
from sealtwin.core.record_files import write_solid
from tests.support.photos import mortar, with_crack, write_png
from tests.support.processes import commands
from tests.support.robot_cells import TAUGHT_CELL
from tests.support.tiny_study import plannable_lab

FUNCTIONS = {
    name: inspect.getdoc(getattr(st, name)) or "" for name in st.__all__ if inspect.isfunction(getattr(st, name))
}
FILLED = ("plan_path", "fill_fast")
COMPARED = (*FILLED, "read_readings", "compare")
BEFORE = {"fill_fast": FILLED[:1], "compare": COMPARED[:-1], "plot_levels": COMPARED, "write_report": COMPARED} | {
    "write_robot_program": FILLED[:1],
    "write_map": ("sweep",),
}
"""Examples that run before another example, which uses their variables."""
TRIAL = """
name = "drawn"
photo = {file = "wide.png", mm_per_px = 0.1, ends_px = [[50, 61], [650, 58]], data = "synthetic"}
crack = {depth_mm = 10, tilt = "vertical"}
path = {speed_mm_s = 5, volume_ml = 1.3}
fluid = {viscosity_pa_s = 1, yield_stress_pa = 5, freeze_after_s = "never"}
solver = {model = "slot", radius_mm = "auto", settle_s = 2}
readings = {file = "levels.csv", data = "synthetic", role = "held-out"}
"""
pytestmark = pytest.mark.filterwarnings("ignore::RuntimeWarning")


@pytest.fixture(scope="module")
def lab(tmp_path_factory) -> Path:
    """Files that the examples name."""
    folder = plannable_lab(tmp_path_factory.mktemp("lab"))
    (folder / "cell.toml").write_text(TAUGHT_CELL)
    write_solid(folder, st.build_solid(st.crack_from_polyline([(0, 20), (60, 20)], 3), 10.0, tilt="vertical"))
    drawing = ezdxf.filemanagement.new(units=units.MM)
    drawing.modelspace().add_lwpolyline([(0, 20), (60, 20)], dxfattribs={"layer": "MIDDLE"})
    drawing.saveas(folder / "crack.dxf")
    write_png(folder / "wide.png", with_crack(mortar((700, 120)), [(50, 61), (350, 64), (650, 58)], 30))
    (folder / "levels.csv").write_text("s_mm,level_1_mm\n10,-2.2\n20,-2\n30,-2.1\n40,-2\n50,-2.3\n")
    (folder / "trial.toml").write_text(TRIAL)
    return folder


def calibrated(words, progress, accurate, *, out, **options):
    """Parse the words of 'sealtwin calibrate' and answer in its place, since a calibration needs a minute."""
    line = [*map(str, words[1:]), *(f"--{name}={value}" for name, value in options.items() if value is not None)]
    commands()["calibrate"].make_context("calibrate", line)
    Path(out).mkdir()
    np.savetxt(Path(out, "posterior.csv"), np.full((500, 1), 9.0), header="fluid.yield_stress_pa", comments="")
    free = [{"setting": "fluid.yield_stress_pa", "identified": True}]
    return json.loads(json.dumps({"page": f"{out}/page.html", "possible": True, "free": free, "fluid_warnings": []}))


SLOW = ("plan_flow",)
"""Example that computes particles. ``make test`` runs the same plan by its command."""


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in FUNCTIONS])
def test_each_docstring_example_prints_the_output_that_it_shows(name, lab, monkeypatch):
    monkeypatch.chdir(lab)
    monkeypatch.setattr(studies, "_command", calibrated if name == "calibrate" else studies._command)
    names = {"st": st}
    # A sweep is a program of its own, which takes seconds to start.
    for part in (*(() if name == "write_map" and Path("swept").is_dir() else BEFORE.get(name, ())), name):
        example = doctest.DocTestParser().get_doctest(FUNCTIONS[part], names, part, None, None)
        assert example.examples, part
        faults = list[str]()
        ran = doctest.DocTestRunner(verbose=False).run(example, out=faults.append, clear_globs=False)
        assert ran.failed == 0, "".join(faults)
        names = example.globs
