"""The page's own fast model against the one in Python, and what the page does with it."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import qmc

from sealtwin.core import record_files
from sealtwin.core.progress import Progress
from sealtwin.trial.pipeline import run_trial
from sealtwin.trial.trial_file import load_trial
from tests.live_page import level_mm, move, poured, write_changed
from tests.studies import TRIAL, tiny_lab

pytestmark = pytest.mark.browser

SLIDERS = ("flow_mm3_s", "speed_mm_s", "yield_stress_pa", "mean_width_mm")
HOSTILE = '</script><script>struck = 1</script><!-- \u2028 \\u003c "@"'
BY_PARTICLES = TRIAL.replace("U = 30.0\nD_cm = 0.3", "viscosity_pa_s = 0.3\nyield_stress_pa = 3.0").replace(
    "freeze_after_s = 0.2", 'freeze_after_s = "never"'
)
BY_SLOT = BY_PARTICLES.replace("[solver]", '[solver]\nmodel = "slot"\nsettle_s = 1.0')
THINNING = (
    BY_SLOT.replace("viscosity_pa_s = 0.3", "consistency_pa_s_n = 0.8\nflow_index = 0.6\nwall_share = 0.6")
    .replace('tilt = "vertical"', 'tilt = "funnel"\nwall_angle_deg = 5.0')
    .replace("trim_mm = 1", 'trim_mm = 1\nflow = "cross_section"\nreverse = true\nramp_mm = 2\nlead_out_mm = 3')
    .replace("[fluid]", "[sample]\ngradient_deg = 6.0\n\n[fluid]")
)


def write_run(folder: Path, text: str, name: str = "tiny") -> Path:
    """A lab with a trial that was run, and the page of its report."""
    tiny_lab(folder)
    trial = folder / "trial.toml"
    trial.write_text(text, encoding="utf-8")
    named = load_trial(trial).model_copy(update={"name": name, "note": name})
    run_trial(named, folder, folder / "out", ("digitise", "simulate", "validate"), "cpu", Progress())
    return folder / "out" / "report.html"


@pytest.fixture(scope="module")
def by_slot(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("slot"), BY_SLOT, HOSTILE)


@pytest.fixture(scope="module")
def thinning(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("thinning"), THINNING)


@pytest.fixture(scope="module")
def by_particles(tmp_path_factory):
    return write_run(tmp_path_factory.mktemp("particles"), BY_PARTICLES)


@pytest.mark.parametrize(("made", "seed"), [("by_slot", 1), ("thinning", 2)])
def test_the_level_is_that_of_the_command_on_the_file_that_the_page_writes(made, seed, request, open_report, tmp_path):
    """Ten settings each. The issue allows 0.01 mm; numbers of the page have digits that leave 1e-4."""
    file = request.getfixturevalue(made)
    page = open_report(file)
    lab = file.parents[1]
    unfit = set()
    for number, shares in enumerate(qmc.LatinHypercube(4, seed=seed).random(10)):  # pyright: ignore[reportCallIssue]
        move(page, dict(zip(SLIDERS, shares, strict=True)))
        run, profile = poured(write_changed(page, lab / "changed.toml"), tmp_path / str(number))
        assert np.abs(level_mm(page) - profile.level_mm).max() < 1e-3
        assert run.fast_fill is not None
        warning = page.text_content("#live .warning")
        # The settings that would be inside are the command's alone: they take a dozen fills more.
        assert all(reason in warning for reason in run.unfit if not reason.startswith("The case is within"))
        assert bool(warning) == bool(run.unfit)
        assert float(page.inner_text("#live dd >> nth=2").split()[0]) == pytest.approx(
            run.fast_fill.above_face_mm3, abs=0.51
        )
        unfit.add(bool(warning))
    assert len(unfit) == 2, "some are inside the domain and some are not"


def test_a_run_of_particles_gets_differences(open_report, by_particles, tmp_path):
    """Its level as run, plus that of the fast model with these settings less that of the fast model as run."""
    page, lab = open_report(by_particles), by_particles.parents[1]
    own = record_files.read_profile(by_particles.parent)
    assert np.abs(level_mm(page) - own.level_mm).max() < 1e-4
    _, as_run = poured(lab / "trial.toml", tmp_path / "as-run")
    move(page, {"flow_mm3_s": 0.9, "yield_stress_pa": 0.6})
    changed = load_trial(write_changed(page, lab / "changed.toml"))
    assert changed.solver.model is None
    _, now = poured(lab / "changed.toml", tmp_path / "changed")
    by_slot_mm = np.interp(own.s_mm, now.s_mm, now.level_mm - as_run.level_mm)
    assert np.abs(level_mm(page) - np.maximum(-8.0, own.level_mm + by_slot_mm)).max() < 0.01
    assert "level of the particles as run" in page.inner_text("#live")


def test_what_was_not_moved_stays_as_it_was_run(open_report, by_slot):
    """Button As run too; and the width, which the trial left out."""
    page, lab = open_report(by_slot), by_slot.parents[1]
    begun = level_mm(page)
    move(page, {"mean_width_mm": 0.2, "speed_mm_s": 0.0})
    assert np.abs(level_mm(page) - begun).max() > 0.1
    page.click("#live button[value=reset]")
    move(page, {})
    assert (level_mm(page) == begun).all()
    changed, own = load_trial(write_changed(page, lab / "changed.toml")), load_trial(lab / "trial.toml")
    assert changed.photo == own.photo
    assert changed.path.speed_mm_s == own.path.speed_mm_s
    assert changed.path.volume_ml == pytest.approx(own.path.volume_ml, rel=1e-5), "trajectory.csv has six decimals"
    assert changed.fluid == own.fluid
    assert (changed.readings, changed.gate) == (None, None)


def test_names_are_text_in_the_data_and_in_the_trial_file(open_report, by_slot, tmp_path):
    page = open_report(by_slot)
    assert page.evaluate("window.struck") is None
    assert page.locator("script").count() == 3, "the data, the model and the sliders; no turntable without particles"
    changed = load_trial(write_changed(page, tmp_path / "changed.toml"))
    assert changed.name == f"{HOSTILE} (changed)"
    assert changed.note == HOSTILE


@pytest.mark.parametrize(("width", "scheme"), [(320, "dark"), (1280, "light")])
def test_it_fits_the_window_and_axe_finds_nothing(open_report, by_slot, width, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    page = open_report(by_slot, width=width, color_scheme=scheme)
    move(page, {"yield_stress_pa": 1.0})
    assert page.locator("#live .warning").is_visible()
    assert page.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
    violations = axe.run(page).response["violations"]
    assert [(rule["id"], [node["html"][:80] for node in rule["nodes"]]) for rule in violations] == []


def test_it_is_not_printed_and_not_there_without_scripts(open_report, by_slot):
    page = open_report(by_slot)
    assert page.locator("#live").is_visible()
    page.emulate_media(media="print")
    assert not page.locator("#live").is_visible()
    page = open_report(by_slot, java_script_enabled=False)
    assert not page.locator("#live").is_visible()
    assert not page.locator("#live-link").is_visible()
