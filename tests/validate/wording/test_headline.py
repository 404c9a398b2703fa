"""What a report says first: cautions where there is a reason, the verdict, and the answer in plain sentences."""

from dataclasses import replace

import pytest

from sealtwin.core.run_figures import RunHealth
from sealtwin.core.solid_figures import WeighedCavity
from tests.evidence import make_evidence
from validate.settings import Gate
from validate.wording.headline import cautions, headline, in_short, key_figures, run_warnings

GATE = Gate(mean_error_mm=1.0)


@pytest.fixture(scope="module")
def run(evidence):
    """Nothing over the edge, nothing through a wall."""
    return replace(evidence.run, spilled=evidence.run.spilled & False)


@pytest.fixture(scope="module")
def unread(tmp_path_factory):
    return make_evidence(tmp_path_factory.mktemp("unread"), readings_data=None)


def test_what_a_weighed_fill_contradicts_is_said_first(evidence):
    assert cautions(evidence) == (), "measured data and a sound run need no word"
    nothing = (0.0, 0.0, 0.0)
    weighed = WeighedCavity((), (), (), (), (), 3.0, 5.0, 16.0, (nothing,) * 3, (1.0, 2.0), ("The fill contradicts.",))
    figures = replace(evidence.solid.figures, weighed=weighed)
    assert cautions(replace(evidence, solid=replace(evidence.solid, figures=figures))) == ("The fill contradicts.",)


@pytest.mark.parametrize(
    ("readings_data", "photo_data", "begins"),
    [
        ("reconstructed", "measured", "the caliper readings are reconstructed. "),
        ("measured", "synthetic", "the photo is synthetic. "),
        (None, "synthetic", "the photo is synthetic. "),
        ("measured", "undeclared", "it is not declared whether the photo is measured. "),
        ("undeclared", "measured", "it is not declared whether the caliper readings are measured. "),
        ("reconstructed", "synthetic", "the photo is synthetic and the caliper readings are reconstructed. "),
    ],
)
def test_only_what_was_not_measured_is_named(tmp_path, readings_data, photo_data, begins):
    evidence = make_evidence(tmp_path, readings_data=readings_data, photo_data=photo_data, gate=GATE)
    (caution,) = cautions(evidence)
    assert caution.startswith("Not a validation: " + begins)
    assert "alidated" not in headline(evidence)[0]


def with_preset(run, preset: str):
    return replace(run, settings={**run.settings, "solver": {**run.settings["solver"], "preset": preset}})


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
    (lost,) = run_warnings(replace(run, spilled=spilled & (spilled.cumsum() < 3)), 0.8)
    assert lost.startswith("The fluid lost 20 %")
    (gained,) = run_warnings(replace(run, spilled=spilled), 1.04)
    assert gained.startswith("The fluid gained 15 %")
    # The ratio that the terminal prints is of all sealant.
    assert f"({1.04 / (1 - share):.3f} of what stayed on the sample; " in gained


def test_a_leak_comes_first(run, evidence, unread):
    first, second = run_warnings(replace(run, escaped_particles=1), 0.775)
    assert first.startswith("Do not use: 1 particle went through a wall")
    assert second.startswith("The fluid lost")
    leaking = replace(evidence, run=replace(run, escaped_particles=11), photo_data="synthetic")
    assert [text.split(":")[0] for text in cautions(leaking)] == ["Do not use", "Not a validation"]
    leaking = replace(unread, run=replace(run, escaped_particles=2))
    assert headline(leaking) == (("Do not use: 2 particles went through a wall. There are no readings.",), "failed")


def test_files_that_somebody_edited_come_before_everything(run, evidence):
    edited = replace(evidence, run=replace(run, escaped_particles=1), edited=("profile.csv", "simulation.json"))
    assert cautions(edited)[0].startswith("Edited by hand since (profile.csv, simulation.json): ")
    assert headline(replace(edited, run=run, comparison=None))[1] == "undecided"


@pytest.mark.parametrize(("compressed", "warned"), [(0.0999, False), (0.101, True), (None, False)])
def test_a_bed_that_is_compressed_is_told_with_what_to_do(run, compressed, warned):
    texts = run_warnings(replace(run, health=RunHealth(density_error_p95=compressed)), 1.0)
    assert len(texts) == warned
    begins = "The bed is compressed: 5 % of its particles by more than 10 %"
    assert all(text.startswith(begins) and 'solver.pressure = "two-level"' in text for text in texts)


def test_what_is_on_already_is_not_advised(run):
    settings = {"solver": {"pressure": "two-level"}}
    (text,) = run_warnings(replace(run, settings=settings, health=RunHealth(density_error_p95=0.2)), 1.0)
    assert "two-level" not in text
    assert "solver.substeps" in text


@pytest.mark.parametrize(
    ("gate", "error_mm", "outcome", "lies"),
    [
        (GATE, 0.5, "passed", "0.5 mm above"),
        (GATE, -1.5, "failed", "1.5 mm below"),
        (None, 0.0, "open", "as high as"),
    ],
)
def test_the_headline_is_the_verdict_and_then_by_how_much_and_to_which_side(tmp_path, gate, error_mm, outcome, lies):
    evidence = make_evidence(tmp_path, gate=gate, error_mm=error_mm)
    assert evidence.comparison is not None
    assert headline(evidence) == (evidence.comparison.headline, outcome)
    nearness, whereabouts = in_short(evidence)
    assert f"{abs(error_mm):.1f} mm off the readings on average" in nearness
    assert lies in nearness
    assert "ml dispensed" in whereabouts


def test_without_readings_nothing_is_compared_and_it_says_where_the_sealant_went(unread):
    assert headline(unread)[1] == "open"
    assert "mean error" not in dict(key_figures(unread))
    (whereabouts,) = in_short(unread)
    assert "; less than 0.01 ml ran over the edge" in whereabouts, "one particle of the case did"
