"""The walls' share of a paste's stress by strips that slide: its closed form, its interval, and what is refused."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from sealtwin.cli.app import app
from sealtwin.core.errors import InputError
from sealtwin.material.by_strip import StripErrors, share_of
from simulate.material_file import read_material
from simulate.settings import Fluid

EXACT = StripErrors(mass_error_g=1e-6, side_error_mm=1e-6, rise_error_mm=1e-6)
STRIP = {"mass_g": 6.0, "length_mm": 60.0, "width_mm": 20.0, "rise_mm": 12.0, "over_mm": 120.0}
STRESS_PA = 6e-3 * 9.81 * 0.1 / (60e-3 * 20e-3)
PASTE = """
method = "spread"
date = "2026-11-27"
data = "measured"
yield_stress_pa = 10.0
yield_stress_error_pa = 0.5
yield_stress_95_pa = [9.0, 11.0]
viscosity_pa_s = 0.4
viscosity_error_percent = 10.0
density_kg_m3 = 1690.0
density_error_kg_m3 = 17.0
not_for = ["x"]
"""


def strips(**changed: float) -> dict[str, np.ndarray]:
    return {name: np.full(4, value) for name, value in (STRIP | changed).items()}


def test_a_strip_slides_at_its_weight_along_the_face():
    measured = share_of(strips(), EXACT, 10.0, 0.0)
    assert measured.stress_pa == pytest.approx(np.full(4, STRESS_PA))
    assert measured.share.value == pytest.approx(STRESS_PA / 10)
    assert measured.share.interval == pytest.approx((STRESS_PA / 10,) * 2, rel=1e-5)


@pytest.mark.parametrize(
    ("errors", "stress_error_pa", "relative"),
    [
        (EXACT, 1.0, 0.1),
        (EXACT.model_copy(update={"mass_error_g": 0.6}), 0.0, 0.1),
        (EXACT.model_copy(update={"rise_error_mm": 1.2}), 0.0, 0.1),
        (EXACT.model_copy(update={"side_error_mm": 2.0}), 0.0, np.hypot(2 / 60, 2 / 20)),
    ],
)
def test_each_error_that_strips_share_widens_the_interval_by_itself(errors, stress_error_pa, relative):
    share = share_of(strips(), errors, 10.0, stress_error_pa).share
    assert np.log(share.interval[1] / share.value) == pytest.approx(1.96 * relative, rel=1e-3)


def test_scatter_alone_has_students_interval():
    """Of four strips: t is 3.18, over the root of four."""
    some = strips() | {"rise_mm": np.array([11.0, 12.0, 12.0, 13.0])}
    share = share_of(some, EXACT, 10.0, 0.0).share
    sd = np.std([11, 12, 12, 13], ddof=1) / 12
    assert np.log(share.interval[1] / share.value) == pytest.approx(3.1824 * sd / 2, rel=1e-3)


def test_no_wall_takes_up_more_than_the_paste_bears():
    rough = share_of(strips(), StripErrors(), STRESS_PA * 0.98, 0.05).share
    assert rough.value == rough.interval[1] == 1.0
    with pytest.raises(InputError, match=r"yield stress of 2 Pa"):
        share_of(strips(), StripErrors(), 2.0, 0.05)


def _called(folder: Path, *line: str):
    return CliRunner().invoke(app, ["material", "strip", str(folder / "strips.csv"), "--data", "measured", *line])


@pytest.fixture
def lab(tmp_path) -> Path:
    (tmp_path / "material.toml").write_text(PASTE, encoding="utf-8")
    rows = "\n".join(",".join(f"{value:g}" for value in (STRIP | {"rise_mm": at}).values()) for at in (11, 12, 13))
    (tmp_path / "strips.csv").write_text(f"{','.join(STRIP)}\n{rows}\n", encoding="utf-8")
    return tmp_path


def test_a_trial_slides_by_the_share_that_the_material_has(lab):
    out, of = lab / "on-the-wall.toml", ["--of", str(lab / "material.toml")]
    answer = _called(lab, *of, "--out", str(out), "--json")
    assert answer.exit_code == 0, answer.output
    share = tomllib.loads(out.read_text())["wall_share"]
    assert share == json.loads(answer.stdout)["wall_share"] == pytest.approx(STRESS_PA / 10, rel=1e-3)
    fluid = Fluid.model_validate({"material": out, "freeze_after_s": "never"}).loaded(lab)
    assert fluid.wall_share == share
    assert read_material(out).yield_stress_pa == 10.0
    twice = Fluid.model_validate({"material": out, "freeze_after_s": "never", "wall_share": 0.9})
    with pytest.raises(InputError, match=r"on-the-wall.toml: has wall_share"):
        twice.loaded(lab)


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ([], 2, ["--of", "strip"]),
        (["--of", "material.toml", "--density-kg-m3", "1690"], 2, ["--density-kg-m3", "strip"]),
    ],
)
def test_options_of_strips(lab, line, code, words):
    answer = _called(lab, *line)
    assert answer.exit_code == code
    assert all(word in answer.output for word in words)


@pytest.mark.parametrize("rise", ["130", "1.1"])
def test_a_face_that_hardly_turned_or_turned_over_is_refused(lab, rise):
    text = (lab / "strips.csv").read_text().replace(",13,120", f",{rise},120")
    (lab / "strips.csv").write_text(text, encoding="utf-8")
    answer = _called(lab, "--of", str(lab / "material.toml"), "--out", str(lab / "out.toml"))
    assert answer.exit_code == 3
    assert f"row 4: rise_mm is {rise}" in " ".join(answer.output.split())
    assert not (lab / "out.toml").exists()


def test_strips_that_disagree_are_doubted_and_a_second_test_replaces_the_first(lab):
    of = ["--of", str(lab / "material.toml"), "--out", str(lab / "one.toml")]
    assert "stresses scatter" not in _called(lab, *of).output
    text = (lab / "strips.csv").read_text().replace(",13,120", ",25,120")
    (lab / "strips.csv").write_text(text, encoding="utf-8")
    again = _called(lab, "--of", str(lab / "one.toml"), "--out", str(lab / "two.toml"))
    assert "stresses scatter by 49 %" in " ".join(again.output.split())
    assert len([line for line in read_material(lab / "two.toml").basis if "strips of paste" in line]) == 1


def test_a_trial_is_no_material(tmp_path):
    """It was answered by a list of the eight keys that it lacks."""
    (tmp_path / "trial.toml").write_text('name = "a trial"\n[photo]\nfile = "a.jpg"\n', encoding="utf-8")
    with pytest.raises(InputError, match=r"trial\.toml: .* it has name and no key of a material") as refused:
        read_material(tmp_path / "trial.toml")
    assert "\n" not in str(refused.value)
