"""The first sentences of a report: cautions, the verdict and the result."""

from dataclasses import replace

import numpy as np
import pytest

from sealtwin.core.facts import doubt, of_keys, texts
from sealtwin.core.run_figures import RunHealth
from sealtwin.core.solid_figures import WeighedCavity
from tests.support.evidence import SEEDS
from validate.report.report_facts import cautions, headline, uncertainty_facts
from validate.run_facts import names_of, run_warnings

FILL = doubt("weighed.contradicts", "The fill contradicts.")


@pytest.fixture(scope="module")
def run(evidence):
    """A run without spilled or escaped particles."""
    return replace(evidence.run, spilled=evidence.run.spilled & False)


TWO = {"particles_across": 2.07}
BED = "The sealant is compressed (5 % of its particles by more than "
LOST = "The fluid lost 22 % of its volume (0.775; 0.95 to 1.05 is valid)"
GAINED = "The fluid gained 11 % of its volume, or bridges empty spaces (1.107"

WARNED = {
    **{f"{ratio} is kept": ({}, {}, ratio, [], []) for ratio in (0.9495, 1.0504)},
    "preset paper loses": ({"solver": {"preset": "paper"}}, {}, 0.775, [LOST, 'Preset "paper"'], []),
    "preset accurate does not": ({"solver": {"preset": "accurate"}}, {}, 0.775, [LOST], ["known"]),
    "two particles across": ({}, TWO, 1.107, [GAINED, "Only 2.1 particles", "solver.radius_mm"], []),
    "four particles across": ({}, {"particles_across": 3.87}, 1.107, ["so its levels are too high."], ["Only"]),
    "a bed of 9.99 %": ({}, {"density_error_p95": 0.0999}, 1.0, [], []),
    "a bed of 10.1 %": ({}, {"density_error_p95": 0.101}, 1.0, [BED + "10 %", "solver.substeps"], []),
}


@pytest.mark.parametrize(("settings", "health", "ratio", "words", "absent"), WARNED.values(), ids=WARNED)
def test_a_wrong_volume_or_a_compressed_bed_gives_a_warning_with_remedy(run, settings, health, ratio, words, absent):
    merged = {name: run.settings.get(name, {}) | more for name, more in settings.items()}
    changed = replace(run, settings=run.settings | merged, health=RunHealth.model_validate(health))
    sentences = texts(run_warnings(changed, ratio))
    assert len(sentences) == bool(words)
    for text in sentences:
        assert text.startswith((BED, "The fluid lost", "The fluid gained"))
        assert [each for each in words if each not in text] + [each for each in absent if each in text] == []


@pytest.mark.parametrize(
    ("settle_s", "freeze_after_s", "to_rest_mm", "says"),
    [(0.0, "never", 0.01, True), (2.0, "never", 0.01, False), (0.0, 2.58, 0.01, False), (0.0, "never", 0.0, False)],
)
def test_paste_that_is_measured_before_it_has_settled_gives_a_warning(run, settle_s, freeze_after_s, to_rest_mm, says):
    settings = {"solver": {"settle_s": settle_s}, "fluid": {"freeze_after_s": freeze_after_s}}
    poured = replace(run, settings=run.settings | settings, health=RunHealth(to_rest_mm=to_rest_mm))
    assert [fact for fact in run_warnings(poured, 1.0) if fact.key == "fluid.unsettled"][says:] == []
    assert bool(run_warnings(poured, 1.0)) is says


def test_a_mean_of_draft_runs_is_marked_as_a_draft(run, evidence):
    settings = {**run.settings, "solver": {"preset": "draft", "accurate_radius_mm": 0.25}}
    drafts = replace(evidence, run=replace(run, settings=settings), seeds=SEEDS)
    (draft,) = texts(of_keys(cautions(drafts), "method.draft"))
    assert f"{run.radius_mm:g} mm radius (accurate: 0.25 mm)" in draft
    assert "solver." not in " ".join(texts(run_warnings(drafts.run, 0.775)[1:])), "preset is the cure"
    assert SEEDS.warnings[0] in cautions(drafts), "of another run"
    assert {"seeds.mean", "seeds.first", "seeds.drafts"} <= {fact.key for fact in uncertainty_facts(drafts)}
    assert not of_keys(uncertainty_facts(replace(evidence, seeds=SEEDS)), "seeds.drafts")
    assert (names_of(SEEDS), names_of(SEEDS.model_copy(update={"seeds": (5, 6)}))) == ("0 to 2", "5 and 6")
    assert "these are 3 runs" in uncertainty_facts(replace(drafts, comparison=None, readings=None))[-1].text


def test_spilled_sealant_is_not_reported_as_lost_volume(run):
    """The ratio that the terminal prints refers to all sealant, including the spilled part."""
    spilled = np.arange(len(run.spilled)) < len(run.spilled) // 10
    share, spills = spilled.mean(), replace(run, spilled=spilled)
    (text,) = texts(run_warnings(spills, 1 - share))
    assert text.startswith(f"{spilled.sum()} particles ({100 * share:.1f} % of the sealant) ran over")
    lost, ran = texts(run_warnings(spills, 0.9 * (1 - share)))
    assert (lost[:23], ran) == ("The fluid lost 10 % of ", text)
    (gained,) = texts(run_warnings(spills, 1.04))
    assert gained.startswith("The fluid gained 15 %")
    assert f"({1.04 / (1 - share):.3f} of what stayed on the sample; " in gained


def test_cautions_include_edited_files_escaped_particles_and_contradicted_fills(run, evidence):
    leak, loss = run_warnings(replace(run, escaped_particles=1), 0.775)
    assert (leak.key, leak.value, loss.key) == ("fluid.escaped", 1, "fluid.volume")
    assert cautions(evidence) == (), "measured data and a sound run need no word"
    nothing = (0.0, 0.0, 0.0)
    weighed = WeighedCavity((), (), (), (), 3.0, 5.0, 16.0, (nothing,) * 3, (1.0, 2.0), (FILL,))
    solid = replace(evidence.solid, figures=replace(evidence.solid.figures, weighed=weighed))
    assert cautions(replace(evidence, solid=solid)) == (FILL,)
    leaking = replace(evidence, run=replace(run, escaped_particles=11), photo_data="synthetic")
    assert [fact.key for fact in cautions(leaking)] == ["fluid.escaped", "data.not-a-validation"]
    edited = replace(leaking, edited=("profile.csv", "simulation.json"))
    assert "(profile.csv, simulation.json)" in cautions(edited)[0].text
    assert headline(replace(edited, run=run, comparison=None))[1] == "undecided"
    (fact,), outcome = headline(replace(leaking, readings=None, comparison=None))
    assert (fact.key, fact.value, fact.level, outcome) == ("verdict.leak", 11, "fault", "failed")


def test_readings_of_a_crack_of_assumed_scale_are_no_validation(evidence):
    """A measured photo whose scale is invented has no measured length. Without readings nothing is compared."""
    of_scale = replace(evidence.outline, warnings=(doubt("scale.assumed", "the scale is assumed"),))
    assumed = replace(evidence, outline=of_scale)
    assert cautions(assumed)[0].text.startswith("Not a validation: the scale is assumed.")
    assert cautions(replace(assumed, comparison=None)) == ()
