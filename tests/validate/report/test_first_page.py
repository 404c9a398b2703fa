"""Texts of the first page: verdict, two sentences and four figures for each kind of trial."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sealtwin.core.doubts import Doubt, Location
from sealtwin.core.facts import doubt
from tests.support.evidence import FAST_FILL, make_evidence
from validate.compare import assess
from validate.figures.first_figure import BAND_NEXT, BAND_READ
from validate.report.first_page import first_caption, first_page, station_rows
from validate.settings import Gate, Readings, Uncertainty

FITTED = ("fluid.U", "fluid.yield_stress_pa")


def judged(evidence, role="held-out", gate_mm=None, fitted=None):
    settings = Readings.model_validate(
        {"file": Path("caliper.csv"), "data": evidence.readings.data, "role": role, "fitted": fitted}
    )
    gate = None if gate_mm is None else Gate(mean_error_mm=gate_mm, reason="of the joint")
    return replace(evidence, comparison=assess(evidence, settings, Uncertainty(), None, gate))


@pytest.mark.parametrize(
    ("role", "gate_mm", "fitted", "state", "verdict", "tested"),
    [
        ("held-out", 2.0, None, "✓ Within its limit of 2 mm", "Tested: the simulation is 0.50 mm off", "Yes"),
        ("held-out", 0.1, None, "✕ Beyond its limit of 0.1 mm", "beyond the limit of 0.1 mm", "Yes"),
        ("held-out", None, None, "○ No limit declared", "Tested: ", "Yes"),
        ("calibrated-on", 2.0, FITTED, "○ Fitted, not tested", "to which it was fitted. Not yet tested", "No"),
        ("calibrated-on", 0.1, FITTED, "✕ Beyond", "Although fitted to the readings", "No"),
        ("undeclared", None, None, "○ No limit declared", "The simulation is 0.50 mm off the readings", "Not declared"),
    ],
    ids=["within", "beyond", "no limit", "fitted", "fitted, beyond", "undeclared"],
)
def test_each_verdict_states_the_error_and_whether_the_trial_is_a_test(
    evidence, role, gate_mm, fitted, state, verdict, tested
):
    trial = judged(evidence, role, gate_mm, fitted)
    page = first_page(trial)
    assert page.state.startswith(state)
    assert verdict in page.verdict
    titles = ("Mean error", "Something simpler instead", "Where the sealant went", "Tested?")
    assert tuple(tile.title for tile in page.tiles) == titles
    assert (page.tiles[0].figure, page.tiles[3].figure) == ("0.50 mm", tested)
    assert ("of the joint" in page.tiles[0].text) is (gate_mm is not None)
    words = " ".join([page.subject, page.state, page.verdict, *page.lead, *(" ".join(label) for label in page.labels)])
    assert len(words.split()) <= 130
    _is_plain(page, first_caption(trial))
    assert ("viscosity weight (U), yield stress" in page.tiles[3].text) is (fitted is not None)


def _is_plain(page, caption):
    """Readers took a band of 95 % for a tolerance, and did not know what a station is."""
    texts = [page.verdict, *page.lead, *(tile.text for tile in page.tiles), caption, BAND_READ, BAND_NEXT]
    assert not [text for text in texts if "95 %" in text or "station" in text]
    assert "19 of 20" in caption
    assert "no tolerance" in caption


def test_the_first_page_counts_the_remarks_on_the_readings_and_quotes_three(evidence):
    remarks = tuple(Doubt("remark", Location(Path("a.csv")), f"A{row} 'wet'.", is_remark=True) for row in range(4))
    (label,) = first_page(judged(replace(evidence, readings=replace(evidence.readings, questions=remarks)))).labels
    assert (label[0][:2], re.findall(r"A\d", label[1])) == ("4 ", ["A0", "A1", "A2"])


def test_a_missed_limit_is_explained_by_offset_or_shape_with_a_remedy(evidence):
    lead = first_page(judged(evidence, gate_mm=0.1)).lead[1]
    assert "0.5 mm too high on average; with this shift removed, its mean error is 0.0 mm" in lead
    assert "readings' zero" in lead
    level_mm = evidence.profile.level_mm - 0.5 + 0.8 * np.sign(evidence.profile.s_mm - 20.0)
    bent = judged(replace(evidence, profile=replace(evidence.profile, level_mm=level_mm)), gate_mm=0.1)
    assert "check the sealant" in first_page(bent).lead[1].lower()


@pytest.mark.parametrize(
    ("change_mm", "words"),
    [
        (lambda s_mm: 0 * s_mm, r"off most at \d+ mm from the start, 0\.5 mm too high"),
        (
            lambda s_mm: np.where(np.abs(s_mm - 12.5) < 1.0, -3.0, 0.0),
            r"2\.5 mm too low, between readings; at a reading it is off by at most 0\.5 mm",
        ),
        (lambda s_mm: 0 * s_mm - 0.5, r"^The line meets every reading\.$"),
    ],
    ids=["at a reading", "between", "nowhere"],
)
def test_the_first_page_names_the_largest_error_at_and_between_readings(evidence, change_mm, words):
    """Broken on purpose, only the largest error at a reading is named."""
    level = replace(evidence.profile, level_mm=evidence.profile.level_mm + change_mm(evidence.profile.s_mm))
    assert re.search(words, first_page(judged(replace(evidence, profile=level))).lead[1])


def test_the_labels_of_the_first_page_name_faults_and_unmeasured_data(evidence, tmp_path):
    lost = first_page(replace(judged(evidence), volume_ratio=0.8))
    assert lost.labels[0][0] == "Check first:"
    assert "20 %" in lost.labels[0][1]
    drawn = make_evidence(tmp_path, photo_data="synthetic", readings_data="reconstructed")
    labels = dict(first_page(judged(drawn)).labels)
    assert {"synthetic", "reconstructed"} <= set(labels["Not a validation:"].replace(",", "").replace(".", "").split())
    assert first_page(judged(evidence)).labels == ()
    fast = replace(
        evidence.run,
        fast_fill=FAST_FILL.model_copy(update={"unfit": (doubt("unfit.mound", "A mound stays; it is large."),)}),
    )
    unfit = dict(first_page(replace(evidence, run=fast, comparison=None, readings=None)).labels)
    assert "UNFIT" in unfit["Check first:"]


def test_no_verdict_is_given_for_the_fast_model_escaped_particles_or_edited_files(evidence):
    fast = first_page(replace(judged(evidence), run=replace(evidence.run, fast_fill=FAST_FILL)))
    assert (fast.state, fast.tiles[3].figure) == ("○ Fast model: no verdict", "Fast model")
    assert "is for screening, is 0.50 mm off" in fast.verdict
    assert fast.tiles[0].text.endswith("The fast model gets no verdict.")
    escaped = first_page(replace(evidence, run=replace(evidence.run, escaped_particles=1)))
    edited = first_page(replace(judged(evidence), edited=("profile.csv",)))
    assert (escaped.state[:7], edited.state[:19]) == ("✕ Fault", "○ Files were edited")
    assert "no result" in escaped.verdict
    assert "no result" in edited.verdict


def test_the_table_of_stations_has_no_error_beyond_the_compared_stretch(evidence):
    rows = dict(station_rows(judged(evidence)))
    assert rows["read, mm"][0] == "-8.0"
    assert set(rows["error, mm"]) == {"+0.5"}
    beyond = replace(evidence.readings, s_mm=evidence.readings.s_mm + 1.0)
    assert dict(station_rows(judged(replace(evidence, readings=beyond))))["error, mm"][-1] == "-"
