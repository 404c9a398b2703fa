"""Files of a calibration: posterior.csv, material.toml and calibration.json."""

from collections.abc import Sequence
from datetime import date as day
from pathlib import Path
from typing import Any

import numpy as np

from sealtwin.calibration.search import Found, settings_at
from sealtwin.calibration.twin import Twin
from sealtwin.core import files
from sealtwin.core.records import Floats
from sealtwin.material.material_text import material_text
from sealtwin.trial.job import shown
from sealtwin.trial.stage_numbers import NUMBERS
from simulate.material_file import Material
from validate.calibration.free import Marginal
from validate.calibration.summary import Calibrated

POSTERIOR, MATERIAL, RECORD, PAGE = "posterior.csv", "material.toml", "calibration.json", "calibration.html"
NOT_FOR = (
    "another particle radius or number of substeps: at one viscosity, radii of 0.6 and 0.8 mm differ by 0.5 to 0.8 mm",
    "a setting that is not identified, taken alone: only what the posterior predicts is supported",
    "another paste, or the same at another age or temperature",
)


def write(
    folder: Path, found: Found, calibrated: Calibrated, twins: Sequence[Twin], others: Sequence[Twin], date: day
) -> dict[str, Any]:
    """Write posterior and material, where there is a posterior, and return the content of the record."""
    written: list[str] = [RECORD]
    for name in (POSTERIOR, MATERIAL):
        (folder / name).unlink(missing_ok=True)
    if found.draws is not None:
        rows = (settings_at(found.frees, point).values() for point in found.draws)
        names = [free.name for free in found.frees]
        files.write_text(folder / POSTERIOR, "".join(",".join(map(str, row)) + "\n" for row in (names, *rows)))
        written.append(POSTERIOR)
        if (material := _material(found, calibrated, twins[0], date)) is not None:
            files.write_text(folder / MATERIAL, material_text(material))
            written.append(MATERIAL)
    return {
        "version": 1,
        "name": calibrated.name,
        "emulated": calibrated.emulated,
        "possible": found.possible,
        "finding": calibrated.finding,
        "advice": calibrated.advice,
        "cautions": calibrated.cautions,
        "fluid_warnings": [sentence for twin in (*twins, *others) for sentence in twin.fluid_warnings],
        "date": date.isoformat(),
        "radius_mm": list(calibrated.radius_mm),
        "runs_of_each_trial": calibrated.runs,
        "stage_numbers": NUMBERS,
        "free": [_free(one) for one in calibrated.marginals] or [free.name for free in found.frees],
        "combinations": [
            {"parts": dict(zip((free.name for free in found.frees), _rounded(one.parts), strict=True)),
             "deviation_over_prior": round(one.deviation, 4)}
            for one in calibrated.combinations
        ],
        "confounded": [[a.name, b.name, round(r, 3)] for a, b, r in calibrated.confounded],
        "least_implausibility": round(calibrated.least_implausibility, 4),
        "mixing": round(calibrated.mixing, 4),
        "discrepancy_mm": None if calibrated.discrepancy_mm is None else round(calibrated.discrepancy_mm, 4),
        "trials": [
            {
                "trial": twin.name,
                "file": shown(twin.file),
                "role": "calibrated" if twin in twins else "held out",
                "readings": {"file": twin.held.file.name, "data": twin.held.data, "sha256": files.sha256(twin.sheet)},
            }
            for twin in (*twins, *others)
        ],
        "gates": [
            {"trial": name, "residual_mm": round(reach.residual_mm, 4), "noise_mm": round(reach.noise_mm, 4),
             "components": reach.components, "possible": reach.possible, "scatter_of_runs_mm": round(noise, 4)}
            for (name, reach), noise in zip(calibrated.reaches, calibrated.run_noise_mm, strict=True)
        ],
        "predictions": [
            {"trial": one.trial, "role": one.role, "rms_mm": round(one.rms_mm, 4),
             "flat_rms_mm": round(one.flat_rms_mm, 4), "stations_in_band": round(one.held, 4)}
            for one in calibrated.predictions
        ],
        "confirmed_rms_mm": [_confirmed_mm(found, number) for number in range(len(twins))] if found.possible else [],
        "unused_runs": [list(one) for one in calibrated.unused],
        "page": shown(folder / PAGE),
        "files": written,
    }  # fmt: skip


def write_record(folder: Path, content: dict[str, Any]) -> None:
    """Write the record, the last of a calibration's files."""
    files.write_json(folder / RECORD, content)


def _free(one: Marginal) -> dict[str, Any]:
    return {
        "setting": one.free.name,
        "range": [one.free.low, one.free.high],
        "measured": None if one.free.measured is None else list(one.free.measured),
        "best": float(f"{one.best:.6g}"),
        "interval_90": _rounded((one.low, one.high)),
        "width_over_prior": round(one.width_over_prior, 4),
        "identified": one.identified,
    }


def _rounded(values: Sequence[float]) -> list[float]:
    return [float(f"{value:.4g}") for value in values]


def _confirmed_mm(found: Found, trial: int) -> float | None:
    """Root mean square distance of the readings from the mean of the runs that confirm the best setting."""
    levels_mm = found.confirmed_mm(trial)
    if not len(levels_mm):
        return None
    read_mm = found.posterior.evidence[trial].level_mm
    return round(float(np.sqrt(np.mean((levels_mm.mean(axis=0) - read_mm) ** 2))), 4)


def _material(found: Found, calibrated: Calibrated, twin: Twin, date: day) -> Material | None:
    """Return the material, or None where the paste is a curve or thins with shear: a material has two numbers."""
    fluid, best = twin.trial.fluid, settings_at(found.frees, found.best)
    assert fluid is not None, "checked before"
    assert found.draws is not None, "asked only where there is a posterior"
    if fluid.curve is not None or fluid.consistency_pa_s_n is not None:
        return None
    ran = twin.health(len(found.points))
    draws = {free.name: free.values(column) for free, column in zip(found.frees, found.draws.T, strict=True)}
    known = twin.trial.uncertainty
    stress_pa = best.get("fluid.yield_stress_pa", fluid.yield_stress_pa)
    low_pa, high_pa, error_pa = stress_pa, stress_pa, known.yield_stress_pa or 0.0
    if (drawn_pa := draws.get("fluid.yield_stress_pa")) is not None:
        low_pa, high_pa, error_pa = _spread(drawn_pa, stress_pa)
    thickness = next((name for name in ("fluid.viscosity_pa_s", "fluid.U") if name in draws), None)
    percent = known.viscosity_percent or 0.0
    if thickness is not None:
        percent = 100 * float(np.std(np.log(np.maximum(draws[thickness], 1e-9))))
    beside = [
        f"{name} = {value:g}"
        for name, value in best.items()
        if name not in ("fluid.yield_stress_pa", "fluid.viscosity_pa_s", "fluid.U")
    ]
    identified = ", ".join(one.free.name for one in calibrated.marginals if not one.identified)
    health = {"radius_mm": twin.radius_mm, "substeps": ran.get("substeps")}
    return Material(
        method=f"calibration on {len(found.levels_mm)} trial(s), {len(found.points)} runs each",
        date=date.isoformat(),
        data="synthetic" if calibrated.emulated else "measured",
        yield_stress_pa=stress_pa,
        yield_stress_error_pa=error_pa,
        yield_stress_95_pa=(low_pa, high_pa),
        viscosity_pa_s=float(f"{ran['viscosity_pa_s']:.6g}") if ran.get("viscosity_pa_s") else None,
        viscosity_error_percent=round(min(percent, 1000.0), 4) if ran.get("viscosity_pa_s") else None,
        density_kg_m3=fluid.density_kg_m3,
        density_error_kg_m3=getattr(fluid.material, "density_error_kg_m3", 0.0),
        basis=tuple(
            sentence[:300]
            for sentence in (
                *(["readings that nobody measured (EMULATED)"] if calibrated.emulated else []),
                f"joint distribution: {POSTERIOR}; the numbers here are its likeliest draw",
                *(
                    []
                    if error_pa
                    else ["the yield stress was not free, and its uncertainty is not stated: no interval"]
                ),
                *([f"found together with {', '.join(beside)}: set them beside it"] if beside else []),
                *([f"not identified by the readings: {identified}"] if identified else []),
            )
        ),
        not_for=NOT_FOR,
        **health,
    )


def _spread(drawn: Floats, best: float) -> tuple[float, float, float]:
    """Return the ends of the 95 % interval, with the best value in it, and half its half-width."""
    low, high = np.quantile(drawn, [0.025, 0.975])
    return float(f"{min(low, best):.6g}"), float(f"{max(high, best):.6g}"), float(f"{(high - low) / 4:.6g}")
