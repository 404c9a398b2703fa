"""One datum, one set of stations: how far a simulated surface lies from a measured one."""

from typing import Any

import numpy as np

from sealtwin.records import Comparison, DataKind, Outline, Profile, Solid
from validate.comparison.curves import Difference
from validate.comparison.distances import (
    CLOSE_MM,
    area_between,
    area_by_similaritymeasures,
    best_flat_level,
    error_bins,
    frechet_mm,
)
from validate.comparison.repeatability import repeatability
from validate.comparison.verdict import basis_of, judged
from validate.comparison.volumes import fill_volumes
from validate.settings import Gate, Role

AREAS_AGREE = 1e-9


def compare(
    simulated: Profile,
    measured: Profile,
    outline: Outline,
    solid: Solid,
    *,
    role: Role,
    photo_data: DataKind,
    gate: Gate | None = None,
    escaped_particles: int = 0,
) -> Comparison:
    """Metrics of simulated minus measured level over their common stretch of s, all of them exact integrals.

    Between stations both curves are straight, so the error is piecewise linear; positive means that the simulation
    stands too high. ``escaped_particles`` are those of the run that was measured: with one, nothing passes.

    Raises InputError where the two curves do not overlap.
    """
    error = Difference(simulated.s_mm, simulated.level_mm, measured.s_mm, measured.level_mm)
    area_mm2 = area_between(simulated.s_mm, simulated.level_mm, measured.s_mm, measured.level_mm)
    area_library_mm2 = area_by_similaritymeasures(simulated.s_mm, simulated.level_mm, measured.s_mm, measured.level_mm)
    if abs(area_mm2 - area_library_mm2) > AREAS_AGREE * max(1.0, area_mm2):
        raise RuntimeError(f"The two area computations disagree: {area_mm2!r} and {area_library_mm2!r} mm².")
    mean_error_mm = area_mm2 / error.length_mm
    worst = int(np.argmax(np.abs(error.value)))
    bins = error_bins(simulated, measured, outline.length_mm)
    flat_level_mm = best_flat_level(error.x, np.interp(error.x, measured.s_mm, measured.level_mm))
    flat_error_mm = (
        area_between(error.x[[0, -1]], np.full(2, flat_level_mm), measured.s_mm, measured.level_mm) / error.length_mm
    )
    basis = basis_of(measured.s_mm, float(error.x[0]), float(error.x[-1]), outline.length_mm)
    beyond = (measured.s_mm < error.x[0]) | (measured.s_mm > error.x[-1])
    metrics: dict[str, Any] = {
        "covered_from_mm": error.x[0],
        "covered_to_mm": error.x[-1],
        "covered_length_mm": error.length_mm,
        "coverage": basis.coverage,
        "length_mm": outline.length_mm,
        "stations_compared": int((~beyond).sum()),
        "stations_beyond_mm": measured.s_mm[beyond],
        "stations_used": basis.stations,
        "widest_gap_mm": basis.widest_gap * outline.length_mm,
        "enough_readings": basis.suffices,
        "escaped_particles": escaped_particles,
        "area_mm2": area_mm2,
        "area_similaritymeasures_mm2": area_library_mm2,
        "area_difference_mm2": area_mm2 - area_library_mm2,
        "bias_mm": error.mean(),
        "rmse_mm": error.rms(),
        "p95_error_mm": error.quantile(0.95),
        "share_under_1_mm": error.share_within(CLOSE_MM),
        "frechet_mm": frechet_mm(simulated, measured, float(error.x[0]), float(error.x[-1])),
        "error_by_bin": bins,
        "start_zone_error_mm": bins[0]["mean_error_mm"],
        "end_zone_error_mm": bins[-1]["mean_error_mm"],
        "flat_level_mm": flat_level_mm,
        "flat_level_error_mm": flat_error_mm,
        "beats_flat_level": mean_error_mm < flat_error_mm,
        "readings": repeatability(measured),
        "role": role,
        "readings_data": measured.data,
        "readings_dialect": measured.dialect,
        "photo_data": photo_data,
    }
    for name, profile in (("simulated", simulated), ("measured", measured)):
        volumes = fill_volumes(profile, outline, solid, float(error.x[0]), float(error.x[-1]))
        metrics |= {f"{name}_{key}": value for key, value in volumes.items()}
    return judged(
        Comparison(
            mean_error_mm=mean_error_mm,
            worst_error_mm=float(abs(error.value[worst])),
            worst_at_mm=float(error.x[worst]),
            metrics=metrics,
            gate={} if gate is None else {"mean_error_mm": gate.mean_error_mm},
        )
    )
