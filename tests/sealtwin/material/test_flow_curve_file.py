"""Exports of rheometers: what is read without a guess, and refusals that name file, row, column, value and remedy."""

import numpy as np
import pytest

from sealtwin.core.errors import InputError
from sealtwin.material.flow_curve_file import read_flow_curve
from tests.sealtwin.material.flow_curves import RATES, STRESSES, lines, pairs, rheocompass, trios, workbook

READ = {
    "own names": lines("shear_rate_per_s,stress_pa", *pairs(separator=",")).encode(),
    "RheoCompass": rheocompass().encode("utf-16"),
    "RheoCompass in kPa": rheocompass("kPa", 1e-3).encode("utf-16"),
    "RheoCompass in mPa": rheocompass("mPa", 1e3).encode("utf-16"),
    "RheoCompass, two tests of which one is a rest": (
        rheocompass() + "Interval and data points:\t2\t3\nInterval data:\tPoint No.\tTime\tShear Stress\n"
        "\t\t[s]\t[Pa]\n\t1\t1\t3\n\t2\t2\t3\n\t3\t3\t3\n"
    ).encode("utf-16"),
    "a rejected point": rheocompass().replace("\t9\t300", "(invalid)\t9\t300").encode("utf-16"),
    "TRIOS": trios().encode(),
    "RheoWin": lines("t in s\tGP in 1/s\tTau in Pa", *(f"1\t{row}" for row in pairs())).encode("cp1252"),
    "RheoWin in German": lines("D in 1/s;Tau in Pa", *pairs(comma=True, separator=";")).encode("cp1252"),
    "rSpace": lines("Action Name;Shear stress(Pa);Shear rate(s-¹)", *(
        f"sweep;{row.split(';')[1]};{row.split(';')[0]}" for row in pairs(comma=True, separator=";")
    )).encode(),
    "German": lines("Scherrate [1/s];Schubspannung [Pa]", *pairs(comma=True, separator=";")).encode("cp1252"),
    "symbols": lines("\u03b3\u0307 [1/s];\u03c4 [Pa]", *pairs(separator=";")).encode(),
    "French, a value missing": lines(
        "Gradient de cisaillement\tContrainte de Cisaillement\tContrainte de cisaillement (pour oscillation réelle)",
        "[1/s]\t[Pa]\t[Pa]", "0.05\t-", *pairs()
    ).encode(),
    "units in a row below": lines("Shear rate\tShear stress", "s⁻¹\tN/m²", *pairs()).encode(),
    "workbook in kPa": workbook(),
}  # fmt: skip


@pytest.mark.parametrize("name", READ)
def test_an_export_is_read_without_a_guess(tmp_path, name):
    path = tmp_path / ("curve.xlsx" if "workbook" in name else "curve.csv")
    path.write_bytes(READ[name])
    curve = read_flow_curve(path)
    count = len(RATES) - ("rejected" in name)
    assert curve.rate_per_s == pytest.approx(np.array(RATES[:count]), rel=1e-5)
    assert curve.stress_pa == pytest.approx(np.array(STRESSES[:count]), rel=1e-5)
    assert ("left out" in curve.basis) == ("rejected" in name or "missing" in name)


COMMAS = [row.replace("\t", ",") for row in pairs(comma=True)]
REFUSED = {
    "no unit": (lines("Shear rate [1/s];Shear stress", *pairs(separator=";")), ["line 1", "[Pa]"]),
    "mpa is mPa or MPa": (lines("shear_rate_per_s,stress_mpa", *pairs(separator=",")), ["line 1", "'mpa'"]),
    "turns a minute": (lines("Shear rate [rpm];Shear stress [Pa]", *pairs(separator=";")), ["line 1", "'rpm'"]),
    "viscosity of another unit": (rheocompass("kPa"), ["line 7", "Shear Stress", "1e+03 times", "Viscosity"]),
    "two curves": (rheocompass() + rheocompass(interval=2), ["2 curves", "10:18", "29:37", "--rows 29:37"]),
    "two columns": (lines("Shear rate [1/s];Stress [Pa];Stress [Pa]", "1;2;3"), ["line 1", "2 columns"]),
    "decimal commas between commas": (lines("Shear rate [1/s],Stress [Pa]", *COMMAS), ["line 2", "4 fields"]),
    "thousands or decimals": (
        lines("Shear rate [1/s];Stress [Pa]", *(f"{n},000;{n},500" for n in range(1, 8))), ["line 2", "'1,000'"]),
    "no number": (lines("Shear rate [1/s];Stress [Pa]", "1;2", "3;x4", "5;6"), ["line 3", "Stress [Pa]", "'x4'"]),
    "other mark": (lines("Shear rate [1/s];Stress [Pa]", "1.5;2.5", "3.5;4,5"), ["line 3", "'4,5'", "point"]),
    "words in between": (lines("Shear rate [1/s];Stress [Pa]", "1;2", "pump;off", "5;6"), ["line 3", "'pump'"]),
    "no header": (lines("a;b", "1;2"), ["shear_rate_per_s,stress_pa"]),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_would_be_a_guess_is_refused(tmp_path, name):
    text, parts = REFUSED[name]
    path = tmp_path / "curve.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_flow_curve(path)
    assert [part for part in ["curve.csv", *parts] if part not in str(refused.value)] == [], str(refused.value)


def test_one_of_two_curves_is_selected_by_its_rows(tmp_path):
    path = tmp_path / "curve.txt"
    path.write_text(rheocompass() + rheocompass("kPa", 2e-3, 2, 2000.0), encoding="utf-16")
    assert read_flow_curve(path, (29, 37)).stress_pa == pytest.approx(2 * np.array(STRESSES), rel=1e-5)
