"""The page of runs side by side."""

import csv
from dataclasses import replace

from tests.sides import compared, side
from validate.comparison import Baseline
from validate.figures.compare_sheet import compare_sheet
from validate.figures.figure_sheet import FigureTable, write_sheet_of_figures


def test_runs_go_by_numbers_whose_names_the_first_table_has(tmp_path):
    """28 runs, names of 80 emoji: no table has a name in its head. A collapsed figure warns, and fails."""
    sides = [side("🛣" * 80 + str(number), 0.1, lowered_mm=0.1 * number) for number in range(28)]
    sheet = compare_sheet(sides)
    first, *others = [item for part in sheet.parts for item in part.items if isinstance(item, FigureTable)]
    assert [row[0] for row in first.rows] == [str(number) for number in range(1, 29)]
    assert [row[-1] for row in first.rows] == [each.name for each in sides]
    assert not any("🛣" in name for grid in others for name in grid.head)
    write_sheet_of_figures(tmp_path, "compare.html", sheet)
    assert (tmp_path / "compare.html").read_text(encoding="utf-8").count("🛣" * 80 + "27") == 1
    assert "🛣" not in (tmp_path / "figures" / "levels.svg").read_text(encoding="utf-8")
    with (tmp_path / "figures" / "figures.csv").open(encoding="utf-8", newline="") as file:
        assert next(csv.reader(file))[28] == "28 " + sides[27].name


def test_the_nearest_is_told_where_all_are_held_against_the_same():
    assert "Nearest is run 1, a, 0.50 mm off" in compare_sheet([side("a", 0.5), side("b", 0.7)]).finding
    apart = compare_sheet([side("a", 0.5), side("b", 0.2, lowered_mm=1.0)])
    assert "Nearest" not in apart.finding
    names = compare_sheet([side("a", 0.5), side("b", 0.7)]).parts[0].items[0]
    assert isinstance(names, FigureTable)
    assert names.rows[1] == ["2", "0.50", "measured, held-out, the same as of run 1", "b"]


def test_what_was_edited_and_never_measured_is_said_first():
    made_up = replace(side("b", 0.5, data="reconstructed"), edited=["profile.csv"])
    kinds, edits = compare_sheet([side("a", 0.5), made_up]).cautions
    assert "reconstructed" in kinds
    assert "run 2: edited" in edits
    assert "profile.csv" in edits
    assert compare_sheet([side("a", 0.5), side("b", 0.7)]).cautions == []


def test_what_one_run_was_tuned_on_is_held_out_from_none():
    """Whoever set the role: the same numbers were seen."""
    tuned = replace(side("a", 0.5), comparison=compared(role="calibrated-on"))
    (told,) = compare_sheet([tuned, side("b", 0.7), side("c", 0.7, lowered_mm=1.0)]).cautions
    assert told == "Not held out: the readings of run 2 were used to calibrate run 1."


def test_a_run_whose_volume_is_off_is_in_no_ranking_and_stands_apart():
    """It is the nearer one of the two; without its volume it is neither the nearest nor in the mean."""
    lossy = replace(side("b", 0.2), comparison=compared(mean_error_mm=0.2), volume_ratio=1.051)
    sheet = compare_sheet([side("a", 0.5), lossy])
    assert "Nearest is run 1, a, 0.50 mm off" in sheet.finding
    assert ("mean error over held-out trials", "0.50 mm") in sheet.key_figures
    (apart,) = [part.items[0] for part in sheet.parts if part.title == "Not ranked"]
    assert isinstance(apart, FigureTable)
    assert [row[0] for row in apart.rows] == ["2"]
    assert "1.051" in apart.rows[0][1]


def test_the_nearest_is_held_against_its_baselines():
    finding = compare_sheet([side("a", 0.5), side("b", 0.7)]).finding
    assert "The dispensed volume lying flat is 4.00 mm off; the simulation, made without" in finding
    assert "no better" not in finding
    fitted = {"fitted": ("fluid.U", "fluid.D_cm", "crack.tilt"), "baselines": (Baseline("a parabola", 3, 0.1),)}
    tuned = compared(role="calibrated-on", **fitted)
    worse = [replace(each, comparison=tuned) for each in (side("a", 0.5), side("b", 0.7))]
    assert "no closer to these readings than a curve with no more numbers" in compare_sheet(worse).finding


def test_no_finding_comes_from_a_run_that_was_edited():
    """The other run of the two is the nearest, and its error the mean over held-out trials."""
    edited = replace(side("b", 0.2), comparison=compared(mean_error_mm=0.2), edited=["profile.csv"])
    sheet = compare_sheet([side("a", 0.5), edited])
    assert "Nearest is run 1, a, 0.50 mm off" in sheet.finding
    assert ("mean error over held-out trials", "0.50 mm") in sheet.key_figures
    assert "Mean error over the held-out trials: 0.50 mm." in held_out_words(sheet)
    alone = compare_sheet([edited])
    assert "Nearest" not in alone.finding
    assert [name for name, _ in alone.key_figures] == ["settings that differ"]
    assert "No held-out run is ranked" in held_out_words(alone)[0]


def held_out_words(sheet):
    (part,) = [part for part in sheet.parts if part.title == "Held out"]
    return part.words


def test_runs_that_leaked_or_have_another_volume_are_named():
    """In one sentence. To the digits that are shown: 1.0504 is 1.050, which is sound."""
    ratios = (1.0, 1.48, 1.0504, 1.66, 0.949)
    sides = [replace(side(name, 0.5), volume_ratio=ratio) for name, ratio in zip("abcde", ratios, strict=True)]
    (sentence,) = compare_sheet(sides).cautions
    assert next(part for part in compare_sheet(sides).parts if part.title == "Not ranked")
    assert [f"run {number}:" in sentence for number in range(1, 6)] == [False, True, False, True, True]
    assert "1.660 of the dispensed volume settled; 0.95 to 1.05" in sentence
    leaking = [replace(each, volume_ratio=1.0, escaped_particles=2) for each in sides[:2]]
    (sentence,) = compare_sheet([sides[0], *leaking]).cautions
    assert "run 2: particles went through a wall; run 3: particles" in sentence
