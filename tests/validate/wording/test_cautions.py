"""What is said before any number, and only where there is a reason."""

from dataclasses import replace

import pytest

from sealtwin.core.run_figures import RunHealth
from sealtwin.core.solid_figures import WeighedCavity
from tests.evidence import make_evidence
from validate.settings import Gate
from validate.wording.headline import cautions, headline, run_warnings


@pytest.fixture(scope="module")
def run(evidence):
    """Nothing over the edge, nothing through a wall."""
    return replace(evidence.run, spilled=evidence.run.spilled & False)


def with_preset(run, preset: str):
    return replace(run, settings={**run.settings, "solver": {**run.settings["solver"], "preset": preset}})


def test_what_a_weighed_fill_contradicts_is_said_first(evidence):
    nothing = (0.0, 0.0, 0.0)
    weighed = WeighedCavity((), (), (), (), (), 3.0, 5.0, 16.0, (nothing,) * 3, (1.0, 2.0), ("The fill contradicts.",))
    figures = replace(evidence.solid.figures, weighed=weighed)
    assert cautions(replace(evidence, solid=replace(evidence.solid, figures=figures))) == ("The fill contradicts.",)


def test_measured_data_and_a_sound_run_need_no_word(evidence):
    assert cautions(evidence) == ()


@pytest.mark.parametrize(
    ("readings_data", "photo_data", "begins"),
    [
        ("reconstructed", "measured", "Not a validation: the caliper readings are reconstructed. "),
        ("measured", "synthetic", "Not a validation: the photo is synthetic. "),
        (None, "synthetic", "Not a validation: the photo is synthetic. "),
        ("measured", "undeclared", "Not a validation: it is not declared whether the photo is measured. "),
        ("undeclared", "measured", "Not a validation: it is not declared whether the caliper readings are measured. "),
        (
            "reconstructed",
            "synthetic",
            "Not a validation: the photo is synthetic and the caliper readings are reconstructed. ",
        ),
    ],
)
def test_only_what_was_not_measured_is_named(tmp_path, readings_data, photo_data, begins):
    gate = Gate(mean_error_mm=1.0)
    evidence = make_evidence(tmp_path, readings_data=readings_data, photo_data=photo_data, gate=gate)
    (caution,) = cautions(evidence)
    assert caution.startswith(begins)
    assert "alidated" not in headline(evidence)[0]


@pytest.mark.parametrize("ratio", [0.9495, 0.95, 0.997, 1.05, 1.0504])
def test_a_volume_that_is_kept_is_no_news(run, ratio):
    assert run_warnings(run, ratio) == ()


def test_the_volume_that_preset_paper_loses_is_known(run):
    (text,) = run_warnings(with_preset(run, "paper"), 0.775)
    assert text.startswith("The fluid lost 22 % of its volume (0.775; 0.95 to 1.05 is sound)")
    assert 'Preset "paper"' in text
    assert "known" not in run_warnings(with_preset(run, "accurate"), 0.775)[0]


def test_a_gain_with_two_particles_across_names_the_radius(run):
    (text,) = run_warnings(replace(run, health=RunHealth(particles_across=2.07)), 1.107)
    assert text.startswith("The fluid gained 11 % of its volume, or covers hollows (1.107")
    assert "Only 2.1 particles" in text
    assert "solver.radius_mm" in text
    (plain,) = run_warnings(replace(run, health=RunHealth(particles_across=3.87)), 1.107)
    assert plain.endswith("so its levels are too high.")


@pytest.mark.parametrize(("stress_pa", "stands"), [(14.9, False), (15.6, True)])
def test_hollows_under_paste_that_stands_are_the_paste_s(run, stress_pa, stands):
    """1,000 kg/m3 between walls 3.1 mm apart: 15.2 Pa."""
    fluid = {"yield_stress_pa": stress_pa, "density_kg_m3": 1000.0}
    two = RunHealth(particles_across=3.1 / (2 * run.radius_mm))
    (text,) = run_warnings(replace(run, settings={**run.settings, "fluid": fluid}, health=two), 1.5)
    assert ("between walls 3.1 mm apart" in text) == stands
    assert ("solver.radius_mm" in text) == (not stands and 3.1 / (2 * run.radius_mm) < 3)


def test_what_ran_over_the_edge_is_not_lost_by_the_fluid(run):
    spilled = run.spilled.copy()
    spilled[: len(spilled) // 10] = True
    share = spilled.mean()
    (text,) = run_warnings(replace(run, spilled=spilled), 1 - share)
    assert text.startswith(f"{spilled.sum()} particles, {100 * share:.1f} % of the sealant, ran over")
    lost, ran = run_warnings(replace(run, spilled=spilled), 0.9 * (1 - share))
    assert lost.startswith("The fluid lost 10 %")
    assert ran == text
    few = spilled & (spilled.cumsum() < 3)
    (lost,) = run_warnings(replace(run, spilled=few), 0.8)
    assert lost.startswith("The fluid lost 20 %")
    (gained,) = run_warnings(replace(run, spilled=spilled), 1.04)
    assert gained.startswith("The fluid gained 15 %")
    # The ratio that the terminal prints is of all sealant.
    assert f"({1.04 / (1 - share):.3f} of what stayed on the sample; " in gained


def test_a_leak_comes_first(run, evidence):
    first, second = run_warnings(replace(run, escaped_particles=1), 0.775)
    assert first.startswith("Do not use: 1 particle went through a wall")
    assert second.startswith("The fluid lost")
    leaking = replace(evidence, run=replace(run, escaped_particles=11), photo_data="synthetic")
    assert [text.split(":")[0] for text in cautions(leaking)] == ["Do not use", "Not a validation"]


def test_files_that_somebody_edited_come_before_everything(run, evidence):
    edited = replace(evidence, run=replace(run, escaped_particles=1), edited=("profile.csv", "simulation.json"))
    assert cautions(edited)[0].startswith("Edited by hand since (profile.csv, simulation.json): ")
    assert headline(replace(edited, run=run, comparison=None))[1] == "undecided"


@pytest.mark.parametrize(("compressed", "told"), [(0.0999, False), (0.101, True), (None, False)])
def test_a_bed_that_is_compressed_is_told_with_what_to_do(run, compressed, told):
    texts = run_warnings(replace(run, health=RunHealth(density_error_p95=compressed)), 1.0)
    assert [text.startswith("The bed is compressed: 5 % of its particles by more than 10 %") for text in texts] == [
        True
    ] * told
    assert all('solver.pressure = "two-level"' in text for text in texts)


def test_what_is_on_already_is_not_advised(run):
    settings = {"solver": {"pressure": "two-level"}}
    (text,) = run_warnings(replace(run, settings=settings, health=RunHealth(density_error_p95=0.2)), 1.0)
    assert "two-level" not in text
    assert "solver.substeps" in text
