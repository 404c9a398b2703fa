"""Python as a notebook uses it: cracks from lines, the fast model in a loop, readings as lists, short descriptions."""

import re
import tempfile
import warnings
from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot

import sealtwin as st
from tests.support.report_stubs import leave_out_figures

LINE_MM = [(0.0, 20.0), (30.0, 22.0), (60.0, 18.0), (80.0, 20.0)]
PASTE = st.Fluid(viscosity_pa_s=2.0, yield_stress_pa=6.0)


@pytest.fixture(scope="module")
def crack() -> st.CrackOutline:
    return st.crack_from_polyline(LINE_MM, 3.0, face_mm=(80, 40), data="synthetic")


@pytest.fixture(scope="module")
def solid(crack) -> st.Solid:
    return st.build_solid(crack, 16, tilt="vertical", wall_angle_deg=0)


@pytest.fixture(scope="module")
def path(crack, solid) -> st.PlannedPath:
    return st.plan_path(crack, solid, speed_mm_s=4, fill=0.6, trim_mm=10)


def test_the_fast_model_gives_the_level_of_a_run_by_it_and_a_report(crack, solid, path, tmp_path, monkeypatch):
    """``inject`` runs the same model, searches for settings that are fit beside it, and so takes longer."""
    level = st.fill_fast(crack, solid, path, PASTE)
    with pytest.warns(RuntimeWarning, match="fast model"):
        run = st.inject(crack, solid, path, PASTE, solver=st.Solver(model="slot", settle_s=2.0))
    assert np.array_equal(level.level_mm, st.measure_level(run, crack, solid).level_mm)
    assert level.dispensed_mm3 == pytest.approx(path.dispensed_mm3)
    leave_out_figures(monkeypatch)
    readings = st.read_readings([[float(s), -6.0] for s in range(5, 80, 5)], crack, solid)
    page = st.write_report(tmp_path, crack, solid, path, level, st.compare(level, readings, crack, solid))
    assert "The fast model, which is for screening, is" in page.read_text(encoding="utf-8")


def test_the_fast_model_says_what_it_cannot_show(crack, solid, path):
    with pytest.warns(RuntimeWarning) as doubts:
        st.fill_fast(crack, solid, path, st.Fluid(viscosity_pa_s=2.0, yield_stress_pa=40.0))
    assert any("slope" in str(doubt.message) for doubt in doubts)


def test_rows_are_readings_and_with_names_they_are_read_as_a_sheet(crack, solid):
    plain = st.read_readings([[10, -4.0, -4.2], [30, -3.0, np.nan], [50, -2.0, -2.2]], crack, solid)
    assert plain.level_mm == pytest.approx([-4.1, -3.0, -2.1])
    names = ["s [cm]", "depth 1 [mm]", "depth 2 [mm]", "remark"]
    rows = [[1, 4.0, 4.2, "ok"], [3, 3.0, None, ""], [5, 2.0, 2.2, ""]]
    named = st.read_readings(rows, crack, solid, columns=names)
    assert named.s_mm == pytest.approx([10, 30, 50])
    assert named.level_mm == pytest.approx(plain.level_mm)
    assert named.repeats_mm == pytest.approx(plain.repeats_mm, nan_ok=True)
    for rows, columns, words in (
        ([[1, 2], [3]], None, "same length"),
        ([[1, 2], [3]], ["s_mm", "level_mm"], "row 2 has 1"),
        ([[1, "x"]], ["s_mm", "level_mm"], "readings: B2 'x'"),
    ):
        with pytest.raises(st.InputError, match=words):
            st.read_readings(rows, crack, solid, columns=columns)


@pytest.mark.parametrize(
    ("rows", "columns", "words"),
    [
        ([[10, 4], [30, 4]], ["s_mm", "reading"], "Give unit=...."),
        ([[10, 4], [30, 4]], ["s_mm", "reading"], "Give quantity=...."),
        ([[10, 9], [30, -9], [50, 9]], ["s_mm", "level_mm"], "as_written=['B3']"),
        ([[10, 9], [30, -9], [50, 9]], None, "as_written=['B3']"),
        ("s_mm,foo\n10,4\n30,4\n", None, "columns={'levels': ...}"),
    ],
)
def test_what_is_wrong_with_readings_is_told_by_keywords(tmp_path, rows, columns, words):
    """Of lists it named the trial's [readings] and a pairing.csv, and a file in a scratch folder."""
    if isinstance(rows, str):
        (tmp_path / "sheet.csv").write_text(rows, encoding="utf-8")
        rows = tmp_path / "sheet.csv"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            text = "\n".join(st.read_readings(rows, columns=columns).doubts)
        except st.InputError as fault:
            text = str(fault)
    assert words in text
    assert all(str(one.message) in text for one in caught)
    assert not re.search(r"pairing|\[readings|lab\.toml|trial", text)
    assert isinstance(rows, Path) or tempfile.gettempdir() not in text


def test_columns_of_a_file_are_its_table(tmp_path, crack, solid):
    sheet = tmp_path / "sheet.csv"
    sheet.write_text("a,b,c\n10,7,-4.0\n30,8,-3.0\n", encoding="utf-8")
    readings = st.read_readings(sheet, crack, solid, columns={"s": "A", "levels": ["C"]}, unit="mm", quantity="level")
    assert readings.level_mm == pytest.approx([-4.0, -3.0])
    with pytest.raises(st.InputError, match="columns of a file is a table"):
        st.read_readings(sheet, columns=["s_mm", "level_mm"])


def test_records_show_their_main_figures_in_a_line_and_a_table(crack, solid, path):
    level = st.fill_fast(crack, solid, path, PASTE)
    result = st.compare(level, st.read_readings([[10, -4.0], [40, -5.0], [70, -4.0]], crack, solid), crack, solid)
    for record, words in (
        (crack, f"CrackOutline(length {crack.length_mm:.1f} mm, mean width 3.00 mm, ends open and open"),
        (result, f"LevelComparison(mean error {result.mean_error_mm:.2f} mm ("),
        (st.Fluid(U=30, D_cm=0.3), "Fluid(U=30.0, D_cm=0.3)"),
    ):
        assert repr(record).startswith(words)
    assert f"<td>{crack.length_mm:.1f} mm</td>" in crack._repr_html_()


def test_levels_on_axes_of_ones_own_leave_title_colours_and_limits_alone(crack, solid, path):
    figure, ax = pyplot.subplots()
    ax.set(title="mine", ylim=(-30.0, 5.0))
    (own,) = ax.plot([0, 80], [-1, -1])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        levels = [st.fill_fast(crack, solid, path, st.Fluid(viscosity_pa_s=2, yield_stress_pa=y)) for y in (3, 6)]
    for level, label in zip(levels, ("3 Pa", "6 Pa"), strict=True):
        st.plot_levels(level, solid=solid, ax=ax, label=label)
    colours = {line.get_label(): line.get_color() for line in ax.get_lines()}
    assert len({colours["3 Pa"], colours["6 Pa"], own.get_color()}) == 3
    assert (ax.get_title(), ax.get_title(loc="left")) == ("mine", "")
    assert ax.get_ylim()[0] == -30.0
    pyplot.close(figure)
