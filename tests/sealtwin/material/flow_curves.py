"""One flow curve as rheometers' programs export it, with invented stresses: 12 Pa + 4 Pa s^n rate^0.5."""

import io

RATES = (0.1, 0.3, 1.0, 2.51, 6.31, 15.8, 39.8, 100.0, 300.0)
STRESSES = tuple(float(f"{12 + 4 * rate**0.5:.5g}") for rate in RATES)


def pairs(factor: float = 1.0, comma: bool = False, separator: str = "\t") -> list[str]:
    """Return the rows of rate and stress, whose numbers are multiplied by ``factor``."""
    rows = [
        f"{rate:g}{separator}{float(f'{stress * factor:.6g}'):.10g}"
        for rate, stress in zip(RATES, STRESSES, strict=True)
    ]
    return [row.replace(".", ",") for row in rows] if comma else rows


def rheocompass(unit: str = "Pa", factor: float = 1.0, interval: int = 1, viscosity: float = 1000.0) -> str:
    """Return an interval of RheoCompass: a preamble, names, a blank row, units, rows whose first cell is blank."""
    head = [
        "Project:\tPaste",
        "Test:\tFlow curve 1",
        "",
        "Result:\tFlow curve 1 1",
        "",
        f"Interval and data points:\t{interval}\t{len(RATES)}",
        "Interval data:\tPoint No.\tShear Rate\tShear Stress\tViscosity\tTorque\tStatus",
        "\t\t\t\t\t\t",
        f"\t\t[1/s]\t[{unit}]\t[mPa·s]\t[µN·m]\t",
    ]
    rows = [
        f"\t{at}\t{rate:g}\t{stress * factor:.6g}\t{viscosity * stress / rate:.6g}\t{90 * stress:.5g}\tDy_auto"
        for at, (rate, stress) in enumerate(zip(RATES, STRESSES, strict=True), start=1)
    ]
    return "\n".join([*head, *rows, "", ""])


def trios() -> str:
    """Return a text of TRIOS: parameters, then steps, of which the first holds one rate and the second is a sweep."""
    hold = [f"{time:g}\t{time:g}\t53.4{time:g}\t50.0{time:g}\t1.07" for time in range(1, 9)]
    sweep = [f"{at}\t{at}\t{pair[1]}\t{pair[0]}\t1" for at, pair in enumerate(zip(RATES, STRESSES, strict=True))]
    names, units = "Time\tStep time\tStress\tShear rate\tStrain", "s\ts\tPa\t1/s\t%"
    parameters = ["Filename\tpaste", "Sample name\tpaste", "[Geometry Parameters]", "Gap\t2.5 mm"]
    steps = ["[step]", "Peak hold - 1", names, units, *hold, "", "[step]", "Flow sweep - 1", names, units, *sweep]
    return "\n".join([*parameters, *steps]) + "\n"


def workbook() -> bytes:
    from openpyxl import Workbook

    book = Workbook()
    sheet = book.active
    assert sheet is not None
    for row in [
        ("paste 7",),
        ("Shear Rate", "Shear Stress"),
        ("1/s", "kPa"),
        *[(rate, stress / 1000) for rate, stress in zip(RATES, STRESSES, strict=True)],
    ]:
        sheet.append(row)
    file = io.BytesIO()
    book.save(file)
    return file.getvalue()


def lines(*rows: str) -> str:
    return "\n".join(rows) + "\n"
