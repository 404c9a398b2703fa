"""What a report says of the crack and its solid."""

from dataclasses import replace

import numpy as np

from sealtwin.core.records import Sections
from sealtwin.core.solid_figures import DamBox
from tests.evidence import make_evidence
from tests.tables import rows
from validate.report.chapters import chapters


def test_two_angles_and_a_table_of_depths_are_told_as_two_and_as_a_range(tmp_path):
    evidence = make_evidence(tmp_path)
    sections = Sections(np.array([0.0, 40.0]), np.array([10.0, 4.0]), np.array([1.0, 1.0]))
    odd = replace(evidence.solid, tilt="flare", wall_angles_deg=(5.0, 12.5), sections=sections)
    table = rows(replace(evidence, solid=odd), "Crack and solid")
    assert table["depth"] == "4 to 10 mm, from station to station"
    assert table["tilt"] == "flare, left wall 5°, right wall 12.5° from vertical"
    even = rows(evidence, "Crack and solid")
    assert (even["depth"], even["tilt"]) == ("10 mm", "vertical walls")


def test_each_reading_of_the_tilt_has_its_volume(tmp_path):
    solid = rows(make_evidence(tmp_path), "Crack and solid")
    assert solid["tilt"] == "vertical walls"
    assert solid["cavity over sealant"]
    volumes = next(text for name, text in solid.items() if name.startswith("volume for each tilt"))
    assert all(tilt in volumes for tilt in ("lean", "flare", "funnel", "undercut", "vertical"))


def test_dams_are_told_from_the_sample(tmp_path):
    """Whoever prints crack.stl prints them too."""
    evidence = make_evidence(tmp_path)
    assert "also in crack.stl" not in rows(evidence, "Crack and solid")
    figures = replace(evidence.solid.figures, dams=(DamBox((0.0, -4.0, -20.0, 9.0, 0.0, 10.0), end=0),))
    dammed = replace(evidence, solid=replace(evidence.solid, figures=figures))
    row = rows(dammed, "Crack and solid")["also in crack.stl"]
    assert row == "1 dam at open ends, to 10 mm above the face: not part of the sample"
    captions = [
        str(chapter.items[0])
        for which in (evidence, dammed)
        for chapter in chapters(which)
        if chapter.name == "geometry"
    ]
    assert ["with the dams" in caption for caption in captions] == [False, True]


def test_widths_that_vary_along_the_crack_are_called_means(tmp_path):
    solid = rows(make_evidence(tmp_path), "Crack and solid")
    assert {name for name in solid if "width" in name} == {
        "width in the photo, mean",
        "mean width of the mouth, of the floor",
    }
