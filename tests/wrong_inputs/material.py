"""Wrong tables of a paste."""

from pathlib import Path

from tests.wrong_inputs.table import WrongInput, answers

USAGE = 2
DATA = "--data synthetic"
LINE = "1,12.5 3,13.5 10,17 30,27 100,62"  # 12 Pa and 0.5 Pa s

UP = "1,22 3,26 10,40 30,80 100,220"  # 20 Pa and 2 Pa s
DOWN = "1,15 3,18 10,30 30,64 100,183"  # 13 Pa and 1.7 Pa s


def curve(name: str, rows: str, *names: str, options: str = DATA, exit_code: int = 3) -> WrongInput:
    """Rows of shear rate and stress of a rheometer."""

    def make(folder: Path) -> None:
        text = "\n".join(["shear_rate_per_s,stress_pa", *rows.split()])
        (folder / "curve.csv").write_text(f"{text}\n", encoding="utf-8")

    command = f"material rheometer {{given}}/curve.csv --density-kg-m3 1690 --out {{out}}/m.toml {options}"
    return WrongInput(name, make, command, names, exit_code, ("pydantic", "viscosity_error_percent"))


# fmt: off
CASES: list[WrongInput] = [
    curve("five equal stresses", "1,12 3,12 10,12 30,12 100,12", "curve.csv", "viscosity_pa_s", "1 to 100 /s"),
    curve("a curve that is nearly flat", "1,5 3,5.58 10,6.29 30,7.03 100,7.92", "curve.csv", "flow_index"),
    curve("a jump to another paste", "1,6 2,7 4,9 8,13 16,66 32,82 64,114", "curve.csv", "the misfit of"),
    curve("pascals that are kilopascals", "1,0.012 3,0.0135 10,0.017 30,0.027 100,0.062", "at 100 /s", "0.062"),
    curve("a window from large to small", LINE, "--shear-rates", "100 to 1",
        options=f"{DATA} --shear-rates 100:1"),
    curve("a way up and a way down", f"{UP} {' '.join(reversed(DOWN.split()))}", "curve.csv", "the misfit of"),
    curve("a number as Python writes it", "1,12.5 3,13.5 1_0,17 30,27 100,62", "row 4", "shear_rate_per_s", "'1_0'"),
    curve("half of the density", LINE, "density_error_kg_m3", "900",
        options=f"{DATA} --density-error-kg-m3 900"),
    answers("material rheometer {given}/curve.csv --density-kg-m3 1690 --out {out}/material.toml")(
        "a paste without a stated origin is not called measured", curve("", LINE).make, "--data", code=USAGE,
        lacks=("Yield stress",)),
]
# fmt: on
