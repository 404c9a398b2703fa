"""Yield stress of a paste and flow of a pump, identified from the photo of a laid bead."""

import json
import math
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from digitise.robots.cell import Pump, read_pump
from digitise.spread import BeadOutline, bead_of
from sealtwin.core.errors import InputError, present
from sealtwin.material.by_bead import LaidBead, footprint_of, identify
from simulate.bead_law import STRETCH, laid_section
from simulate.material_file import read_material
from tests.support.paths import ROOT
from tests.support.processes import sealtwin
from tests.support.spread_photos import BEAD_FACE_MM, BeadPhoto, write_sheet_table

DENSITY, SPEED = 1690.0, 5.0
PHOTO = BeadPhoto(8.0)
LAID = LaidBead(data="synthetic", density_kg_m3=DENSITY, mass_g=4.4, asked_mm3_s=400.0, speed_mm_s=SPEED)


@pytest.fixture(scope="module")
def bead() -> BeadOutline:
    return bead_of(PHOTO.ring_mm, 0.001, 0.06, (), Path("bead.png"))


def test_the_pump_flow_is_the_speed_times_the_laid_section(bead):
    """The section is the volume between the two lines of the bead's middle over their distance, without the ends."""
    pump, volume = identify(LAID, bead), 4.4e6 / DENSITY
    footprint, one = footprint_of(bead), np.ones(1)
    per_mm = footprint.per_mm(volume * one, one, 0 * one, STRETCH)
    c, half = STRETCH * per_mm[0], 8.0
    ridge = 2 * (c * half + ((c * c + 2 * per_mm[0] * half) ** 1.5 - c**3) / (3 * per_mm[0]))
    assert footprint.volume_mm3(per_mm, one, 0 * one, STRETCH)[1][0] == pytest.approx(ridge, rel=2e-3)
    assert pump.flow_mm3_s.value == pytest.approx(SPEED * float(laid_section(per_mm, ridge * one)[0]), rel=2e-3)
    assert pump.time_s == pytest.approx(volume / pump.flow_mm3_s.value)
    low, high = pump.flow_mm3_s.interval
    assert low < pump.flow_mm3_s.value < high < 1.15 * low
    # At twice the speed the same paste per mm is of twice the flow.
    faster = identify(LAID.model_copy(update={"speed_mm_s": 2 * SPEED}), bead)
    assert faster.flow_mm3_s.value == pytest.approx(2 * pump.flow_mm3_s.value)
    assert faster.stress_pa == pump.stress_pa


def test_the_yield_stress_is_reduced_by_the_term_of_surface_tension(bead):
    one = identify(LAID, bead)
    without = identify(LAID.model_copy(update={"edge_n_m": 0.0, "edge_error_n_m": 0.0}), bead)
    term = 1e3 * 0.005 * bead.area_mm2 / (math.pi * 4.4e6 / DENSITY)
    assert without.stress_pa.value - one.stress_pa.value == pytest.approx(term, rel=1e-6)


def test_a_larger_error_of_each_input_makes_the_interval_wider(bead):
    errors = {"mass_error_g": 0.4, "density_error_kg_m3": 200.0, "edge_error_n_m": 0.02}
    narrow, wide = (
        identify(LAID, bead),
        identify(LAID.model_copy(update=errors), replace(bead, scale_error=0.05, edge_error_mm=0.6)),
    )
    assert wide.stress_pa.error > 1.3 * narrow.stress_pa.error
    for part in ("mass", "density", "scale", "edge", "surface tension"):
        assert wide.parts_pa[part] > 2 * narrow.parts_pa[part], part


def test_the_pump_delay_is_the_distance_from_the_start_over_the_speed(bead):
    """Starts that are 5 mm apart along the bead differ by one second at 5 mm/s."""
    near, far, other = (
        present(identify(LAID.model_copy(update={"start_mm": (x, 30.0)}), bead).delay_s, "delay")
        for x in (21.0, 16.0, 74.0)
    )
    assert far.value - near.value == pytest.approx(1.0, abs=1e-6)
    assert far.interval[0] < far.value < far.interval[1]
    # The delay is the same from the other end of the bead.
    assert other.value == pytest.approx(far.value, abs=0.02)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"start_mm": (16.0, 45.0)}, r"--start-mm 16,45 is not the start of the bead, .* 15\.0 mm to the side"),
        ({"mass_g": 8.0}, r"40 mm long .* 120 mm².* 3\.6 times the square root"),
        ({"mass_g": 1.0}, "spread to a width of 16 mm, as water would do"),
        ({"asked_mm3_s": 4.0}, "--asked-mm3-s is 4. No pump is wrong by a factor of 5"),
        ({"density_error_kg_m3": 900.0}, "uncertainty of mass, density or edge is as large as the value"),
    ],
)
def test_implausible_data_of_a_bead_are_refused(bead, changes, says):
    with pytest.raises(InputError, match=says):
        identify(LAID.model_copy(update=changes), bead)


def test_a_bead_that_hardly_spread_is_refused_with_a_slower_speed():
    """At half the speed a bead has twice the section, and the limit is a share of the section's square root.

    Flows and speeds at the ends of the ranges that --help states are accepted.
    """
    for asked_mm3_s, speed_mm_s in ((1e-3, 0.01), (1e6, 5000.0)):
        LaidBead(**{**LAID.model_dump(), "asked_mm3_s": asked_mm3_s, "speed_mm_s": speed_mm_s})
    ring = replace(PHOTO, radius_mm=4.5, straight_mm=36.0).ring_mm
    stiff = bead_of(ring, 0.001, 0.06, (), Path("bead.png"))
    with pytest.raises(
        InputError, match=r"hardly changes its shape.* Lay a bead at (\d\.\d+) mm/s or slower"
    ) as refusal:
        identify(LAID.model_copy(update={"mass_g": 3.6}), stiff)
    assert "mm long, or measure the spread of a cone" in str(refusal.value)


def documented(*words: str) -> list[str]:
    """The command for a bead as 'measure your paste' has it, with more words, of which an option replaces its own."""
    page = (ROOT / "docs" / "how-to" / "measure-your-paste.md").read_text(encoding="utf-8")
    line = shlex.split(next(line for line in page.splitlines() if line.startswith("sealtwin material bead")))[1:]
    for option in [word for word in words if word.startswith("--") and word in line]:
        del line[line.index(option) : line.index(option) + 2]
    return [*line, *words]


def test_the_documented_command_writes_a_material_and_a_valid_pump_row(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    PHOTO.write(tmp_path / "bead.jpg")
    write_sheet_table(tmp_path / "narrow.toml", BEAD_FACE_MM)
    answer = sealtwin(*documented("--data", "synthetic", "--date", "2026-11-21", "--json"))
    assert answer.exit_code == 0, answer.output
    content, material = json.loads(answer.stdout), read_material(tmp_path / "material.toml")
    assert content["bead_length_mm"] == pytest.approx(46.0, abs=0.1)
    assert material.yield_stress_pa == content["yield_stress_pa"]
    assert any("other flows than the flow of the bead" in sentence for sentence in material.not_for)
    row = content["pump_row"]
    assert list(row) == ["asked_mm3_s", "weighed_g", "time_s", "delay_s"]
    # Four rows, two of them of a bead at twice the flow, are a valid pump table with the flow of the answer.
    double = {**row, "asked_mm3_s": 2 * row["asked_mm3_s"], "time_s": row["time_s"] / 2}
    lines = [",".join(map(str, line.values())) for line in (row, row, double, double)]
    (tmp_path / "pump.csv").write_text("\n".join([",".join(row), *lines]), encoding="utf-8")
    table = read_pump(Pump(file=Path("pump.csv"), density_kg_m3=material.density_kg_m3), tmp_path)
    assert table.given_mm3_s[0] == pytest.approx(content["flow_mm3_s"], rel=1e-3)


@pytest.mark.parametrize(
    ("method", "option", "value", "code", "says"),
    [
        ("bead", "--start-mm", "200,30", 3, "--start-mm 200,30: x is outside the frame's opening of 90 x 60 mm"),
        ("spread", "--cone-mm", "38,19,57", 2, "--cone-mm 38,19,57: expected AxBxH"),
        ("spread", "--cone-mm", "3800x19x57", 2, "--cone-mm: cone_mm.0 = 3800.0: should be at most 1000"),
    ],
)
def test_impossible_values_of_start_mm_and_cone_mm_are_refused(
    tmp_path, monkeypatch, method, option, value, code, says
):
    monkeypatch.chdir(tmp_path)
    PHOTO.write(tmp_path / "bead.jpg")
    write_sheet_table(tmp_path / "narrow.toml", BEAD_FACE_MM)
    frame = ("--markers", "narrow.toml", "--face-mm", "150x150", "--density-kg-m3", 1690, "--data", "synthetic")
    spread = ("material", "spread", "bead.jpg", *frame, option, value)
    answer = sealtwin(*(documented(option, value) if method == "bead" else spread))
    assert answer.exit_code == code
    assert says in " ".join(answer.stderr.replace("│", " ").split())
