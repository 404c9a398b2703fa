"""Twelve cracks filled with nothing but defaults: is the fast model valid, and does the sealant stay below the face?

    python -m benchmarks.first_fills [--particles]

Nobody gives a setting but the depth. The cracks were drawn after the defaults were chosen on 19 others (docs/decisions,
"The solid"): widths of 3 to 8 mm that vary along the crack, depths of 8 to 20, lengths of 60 to 130. With
``--particles``, the fluid run is computed, for about an hour of processor time.
"""

import warnings
from typing import Annotated

import numpy as np
import typer

import sealtwin as st
from benchmarks.table import Row, run_benchmark
from sealtwin.trial.starter_files import SEALANT

SEED, CRACKS = 96, 12
MOST_ABOVE_MM = 0.5


def first_fill(number: int, *, particles: bool) -> tuple[float, int, list[str]]:
    """Return the highest level above the face in mm, the number of reasons why the model is unfit, and warnings."""
    random = np.random.default_rng([SEED, number])
    width_mm, depth_mm, length_mm = random.uniform((3.0, 8.0, 60.0), (8.0, 20.0, 130.0))
    x_mm = np.linspace(0.0, length_mm, 60)
    waves = random.uniform(0.5, 2.0), random.uniform(40.0, 80.0), random.uniform(0.0, 6.0)
    line_mm = np.column_stack([x_mm, 20 + waves[0] * np.sin(2 * np.pi * x_mm / waves[1] + waves[2])])
    widths_mm = width_mm * (1 + 0.15 * np.sin(2 * np.pi * x_mm / 25 + waves[2]))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        crack = st.crack_from_polyline(line_mm, width_mm=np.column_stack([x_mm, widths_mm]), data="synthetic")
        path = st.plan_path(st.build_solid(crack, depth_mm=depth_mm))
        paste = st.Fluid(**{key.removeprefix("fluid."): value for key, value in SEALANT.items()})
        run = st.inject(path, paste, progress=False) if particles else st.fill_fast(path, paste)
    level_mm, unfit = float(run.level.level_mm.max()), 0 if run.fast_fill is None else len(run.fast_fill.unfit)
    sentences = [f"{warning.message}" for warning in caught]
    print(
        f"{number:2}  {width_mm:4.1f} mm wide, {depth_mm:4.1f} deep, {length_mm:5.1f} long: highest {level_mm:+.2f} mm"
    )
    print("".join(f"    {text}\n" for text in sentences), end="")
    return level_mm, unfit, sentences


def main(
    particles: Annotated[bool, typer.Option("--particles", help="Compute the fluid run, not the fast model.")] = False,
) -> list[Row]:
    fills = [first_fill(number, particles=particles) for number in range(CRACKS)]
    cautions = sum(len(sentences) for _, _, sentences in fills)
    return [
        Row("cracks for which the fast model is unfit", sum(unfit > 0 for _, unfit, _ in fills), f"of {CRACKS}", 0, 0),
        Row("cautions", cautions, "", 0, 0),
        Row("highest level above the face", max(level for level, _, _ in fills), "mm", -100.0, MOST_ABOVE_MM),
    ]


if __name__ == "__main__":
    run_benchmark(main)
