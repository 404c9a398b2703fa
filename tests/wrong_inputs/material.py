"""Tables of a paste."""

from pathlib import Path

from tests.wrong_inputs.table import WrongInput

USAGE = 2


def _curve(folder: Path) -> None:
    (folder / "curve.csv").write_text("shear_rate_per_s,stress_pa\n1,12.5\n3,13.4\n10,17.2\n30,27.1\n100,62\n")


CASES: list[WrongInput] = [
    WrongInput(
        "a paste whose origin nobody states is not called measured",
        _curve,
        "material rheometer {given}/curve.csv --density-kg-m3 1690 --out {out}/material.toml",
        ("--data",),
        USAGE,
        ("Yield stress",),
    ),
]
