"""Calibrate settings on the readings of trials, and predict held-out trials, which the calibration does not use."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date as day
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sealtwin.calibration import MAX_FREE, MIN_BUDGET, CalibrationOptions
from sealtwin.calibration.search import (
    CONFIRM,
    DRAWS,
    SearchResult,
    Source,
    Twin,
    WorkAhead,
    fit_to_calibrate,
    search,
    settings_at,
)
from sealtwin.core import files
from sealtwin.core.arrays import Floats, rms
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.progress import Progress, in_words
from sealtwin.core.run_folder import holding, require_own
from sealtwin.material import material_text
from sealtwin.study.runner import StudyOptions
from sealtwin.trial.job import NUMBERS, display_path
from sealtwin.trial.trial_file import SETTINGS, SettingValues, load_trial, no_such_setting, replaced, sets_resolution
from simulate.material_file import KEY_OF_LAW, Material
from simulate.settings import LAWS, VISCOSITIES_PA_S
from validate.calibration.posterior import SMOOTH_ERRORS_MM, Free, Marginal
from validate.calibration.summary import Calibrated, Prediction, predicted_by_emulator, predicted_by_runs
from validate.figures.calibration_page import calibration_page
from validate.figures.page import write_page
from validate.units import counted

LIBRARY = "library"  # Name of the folder that contains a study folder for the runs of each trial
PREDICTING = 12  # Number of posterior draws that are run in a held-out trial
OF_A_POUR = ("path", "crack", "sample", "nozzle")  # Tables of a trial whose values differ from pour to pour
POSTERIOR, MATERIAL, RECORD, PAGE = "posterior.csv", "material.toml", "calibration.json", "calibration.html"
STRESS, INDEX = "fluid.yield_stress_pa", "fluid.flow_index"
THICKNESS = tuple(f"fluid.{key}" for key in (*VISCOSITIES_PA_S, "U"))
NOT_FOR = (
    "another particle radius or number of substeps: at the same viscosity, levels for radii of 0.6 and 0.8 mm differ "
    "by 0.5 to 0.8 mm",
    "the value of a setting that is not identified: the readings support only predictions with the whole posterior",
    "another paste, or the same paste at another age or temperature",
)


def calibrate(
    trials: Sequence[Path],
    options: CalibrationOptions,
    out: Path | None,
    study_options: StudyOptions,
    progress: Progress,
    settings: SettingValues | None = None,
) -> dict[str, Any]:
    """Fit settings to the readings of trials, and write the material, the posterior, the record and the page.

    Returns the object that --json prints. The default of ``out`` is reports/<trial>-calibrated. ``settings`` by dotted
    name replace settings of all trial files. Finished runs are not computed again: if the process is killed, the same
    call continues and writes the same files.

    Raises:
        InputError: A trial, a setting or a role cannot be used, or the folder has files of other programs.
        NumericalError: More than a quarter of the runs cannot be used.
        BusyError: Another process uses the folder.
    """
    held_out, budget = options.hold_out, options.budget
    frees = _checked(trials, options.free, held_out, settings)
    if sets_resolution((*options.free, *(settings or {}))):
        study_options = replace(study_options, drafts=False)
    folder = out or Path("reports", f"{load_trial(trials[0], settings).folder_name}-calibrated")
    require_own(folder, LIBRARY, "calibration")
    with holding(folder), progress:
        work = folder / LIBRARY, study_options, progress, settings
        twins = [
            Twin(file, *work, drafts=budget - CONFIRM) for file in trials
        ]  # The runs of the last round are accurate
        others = [Twin(file, *work) for file in held_out]
        _require_different([*twins, *others])
        for twin in twins:
            twin.require(frees)
        ahead = WorkAhead()
        for twin in (*twins, *others):
            twin.ahead = ahead
            ends = [0, budget - CONFIRM, budget] if twin in twins else [0, PREDICTING]
            ahead.model_s += sum(twin.work_s(begin, end) for begin, end in pairwise(ends))
        progress.note(
            f"{budget} runs of {counted(len(twins), 'trial')}, and {PREDICTING * len(others)} runs of held-out trials: "
            f"about {in_words(ahead.model_s)} in total. The first runs will correct this."
        )
        sources = [Source(twin.name, twin.evidence, twin.run) for twin in twins]
        result = search(frees, sources, budget, progress.note)
        predictions = list[Prediction]()
        if (draws := result.draws) is not None:
            for emulator, evidence, twin in zip(
                result.posterior.emulators, result.posterior.evidence, twins, strict=True
            ):
                predictions.append(_prediction(twin, "calibrated", *predicted_by_emulator(emulator, evidence, draws)))
            predictions += [_predicted(result, draws, twin) for twin in others]
        calibrated = _summary(result, twins, others, predictions)
        content = _written(folder, result, calibrated, twins, others, options.date or day.today())
        content["files"] += write_page(folder / PAGE, calibration_page(calibrated))
        files.write_json(folder / RECORD, content)
        return content


def _checked(
    trials: Sequence[Path],
    ranges: Mapping[str, tuple[float, float]],
    held_out: Sequence[Path],
    settings: SettingValues | None,
) -> list[Free]:
    if not 1 <= len(ranges) <= MAX_FREE:
        raise InputError(
            f"{len(ranges)} free settings are given. Give 1 to {MAX_FREE}, the most that {MIN_BUDGET} runs can resolve."
        )
    for name, (low, high) in ranges.items():
        if name not in SETTINGS:
            raise InputError(f"--free {no_such_setting(name)}.")
        if not low < high:
            raise InputError(f"--free {name}={low:g}:{high:g}: the first number must be smaller than the second.")
        if len(trials) > 1 and name.partition(".")[0] in OF_A_POUR:
            raise InputError(
                f"--free {name}: this setting differs between the {len(trials)} pours, but free settings have the same "
                "value in all trials. Measure it instead of calibrating it, or calibrate one trial."
            )
    roles: dict[Literal["held-out", "calibrated-on"], Sequence[Path]] = {"held-out": trials, "calibrated-on": held_out}
    for wrong, group in roles.items():
        for file in group:
            trial = load_trial(file, settings)
            readings = fit_to_calibrate(file, trial)
            if overridden := replaced(trial, settings or {}, ranges):
                raise InputError(
                    f"--set {overridden[0]}: a --free setting replaces this setting. Give only one of them."
                )
            if readings.role == wrong:
                right = "calibrated-on" if wrong == "held-out" else "held-out"
                raise InputError(
                    f'{file}: readings.role = "{wrong}", but this calibration would use the readings as {right}. '
                    f'Write "{right}", or give another trial.'
                )
    return [Free(name, low, high) for name, (low, high) in ranges.items()]


def _require_different(twins: Sequence[Twin]) -> None:
    for other, twin in combinations(twins, 2):
        same = np.array_equal(twin.readings.level_mm, other.readings.level_mm)
        if twin.folder == other.folder or (same and np.array_equal(twin.readings.s_mm, other.readings.s_mm)):
            part = "name" if twin.folder == other.folder else "readings"
            raise InputError(
                f"{twin.file}: has the same {part} as {other.file}. Give each trial once, and each with another name."
            )


def _predicted(result: SearchResult, draws: Floats, twin: Twin) -> Prediction:
    """Predict a held-out trial by runs at draws of the posterior. The trial's path, crack and nozzle do not change."""
    chosen = draws[np.linspace(0, DRAWS - 1, PREDICTING).astype(int)]
    settings = [settings_at(result.frees, point) for point in chosen]
    runs = [{name: values[name] for name in values if name.partition(".")[0] not in OF_A_POUR} for values in settings]
    all_mm = twin.run([(values, seed) for seed, values in enumerate(runs)])
    levels_mm = [level for level in all_mm if level is not None]
    if len(levels_mm) < PREDICTING // 2:
        raise NumericalError(
            f"{twin.name}: {PREDICTING - len(levels_mm)} of {PREDICTING} runs of this held-out trial failed or have a "
            f"volume error above 5 %: {'; '.join(sorted({reason for _, reason in twin.unused()}))}"
        )
    return _prediction(twin, "held out", *predicted_by_runs(np.array(levels_mm), twin.evidence))


def _prediction(twin: Twin, role: Literal["calibrated", "held out"], mean_mm: Floats, half_mm: Floats) -> Prediction:
    evidence = twin.evidence
    error_mm = 1.96 * np.sqrt(evidence.covariance_mm2.diagonal())
    return Prediction(twin.name, role, twin.data, evidence.s_mm, evidence.level_mm, error_mm, mean_mm, half_mm)


def _summary(
    result: SearchResult, twins: Sequence[Twin], others: Sequence[Twin], predictions: Sequence[Prediction]
) -> Calibrated:
    warnings = [sentence for twin in (*twins, *others) for sentence in twin.fluid_warnings]
    if len(result.frees) >= (stations := sum(twin.stations for twin in twins)):
        counts = f"{counted(len(result.frees), 'free setting')} for {counted(stations, 'station')}"
        warnings.append(f"{counts}: with so many settings, any readings can be fitted exactly.")
    return Calibrated(
        name=" and ".join(twin.name for twin in twins),
        emulated=any(twin.data != "measured" for twin in twins),
        frees=tuple(result.frees),
        draws=result.draws,
        best=result.best,
        runs=len(result.points),
        unused=tuple((twin.name, *run) for twin in twins for run in twin.unused()),
        reaches=tuple(zip((twin.name for twin in twins), result.reaches, strict=True)),
        least_implausibility=result.least_implausibility,
        mixing=result.mixing,
        discrepancy_mm=result.discrepancy_mm,
        run_noise_mm=tuple(
            float(np.sqrt(emulator.run_noise_mm2.diagonal().mean() * emulator.processes.relative.mean()))
            for emulator in result.posterior.emulators
        ),
        predictions=tuple(predictions),
        radius_mm=tuple(twin.radius_mm for twin in twins),
        drafts=tuple((len(result.points) - CONFIRM * result.possible) * twin.drafts for twin in twins),
        warned=tuple(warnings),
    )


def _written(
    folder: Path, result: SearchResult, calibrated: Calibrated, twins: Sequence[Twin], others: Sequence[Twin], date: day
) -> dict[str, Any]:
    """Write the posterior and the material, if there is a posterior, and return the content of calibration.json."""
    written: list[str] = [RECORD]
    for name in (POSTERIOR, MATERIAL):
        (folder / name).unlink(missing_ok=True)
    if result.draws is not None:
        rows = (settings_at(result.frees, point).values() for point in result.draws)
        names = [free.name for free in result.frees]
        files.write_text(folder / POSTERIOR, "".join(",".join(map(str, row)) + "\n" for row in (names, *rows)))
        written.append(POSTERIOR)
        if (material := _material(result, result.draws, calibrated, twins[0], date)) is not None:
            files.write_text(folder / MATERIAL, material_text(material))
            written.append(MATERIAL)
    return {
        "version": 1,
        "name": calibrated.name,
        "emulated": calibrated.emulated,
        "possible": result.possible,
        "finding": calibrated.finding,
        "advice": calibrated.advice,
        "cautions": calibrated.cautions,
        "fluid_warnings": [sentence for twin in (*twins, *others) for sentence in twin.fluid_warnings],
        "date": date.isoformat(),
        "radius_mm": calibrated.radius_mm,
        "runs_of_each_trial": calibrated.runs,
        "drafts_of_each_trial": list(calibrated.drafts),
        "stage_numbers": NUMBERS,
        "free": [_free(marginal) for marginal in calibrated.marginals] or [free.name for free in result.frees],
        "confounded": [[a.name, b.name, r] for a, b, r in calibrated.confounded],
        "least_implausibility": calibrated.least_implausibility,
        "mixing": calibrated.mixing,
        "discrepancy_mm": calibrated.discrepancy_mm,
        "smooth_errors_mm": SMOOTH_ERRORS_MM,
        "trials": [
            {
                "trial": twin.name,
                "file": display_path(twin.file),
                "role": "calibrated" if twin in twins else "held out",
                "readings": {"file": twin.sheet.name, "data": twin.data, "sha256": files.sha256(twin.sheet)},
            }
            for twin in (*twins, *others)
        ],
        "gates": [
            {"trial": name, "residual_mm": reach.residual_mm, "noise_mm": reach.noise_mm,
             "components": reach.components, "possible": reach.possible, "scatter_of_runs_mm": noise}
            for (name, reach), noise in zip(calibrated.reaches, calibrated.run_noise_mm, strict=True)
        ],
        "predictions": [
            {"trial": prediction.trial, "role": prediction.role, "rms_mm": prediction.rms_mm,
             "flat_rms_mm": prediction.flat_rms_mm, "stations_in_band": prediction.share_inside}
            for prediction in calibrated.predictions
        ],
        "confirmed_rms_mm": [_confirmed_mm(result, number) for number in range(len(twins))] if result.possible else [],
        "unused_runs": calibrated.unused,
        "page": display_path(folder / PAGE),
        "files": written,
    }  # fmt: skip


def _free(marginal: Marginal) -> dict[str, Any]:
    return {
        "setting": marginal.free.name,
        "range": [marginal.free.low, marginal.free.high],
        "best": float(f"{marginal.best:.6g}"),
        "interval_90": [marginal.low, marginal.high],
        "width_over_prior": marginal.width_over_prior,
        "identified": marginal.identified,
    }


def _confirmed_mm(result: SearchResult, trial: int) -> float | None:
    """Return the RMS difference between a trial's readings and the mean level of the runs with the best settings."""
    levels_mm = result.confirmed_mm(trial)
    if not len(levels_mm):
        return None
    read_mm = result.posterior.evidence[trial].level_mm
    return rms(levels_mm.mean(axis=0) - read_mm)


def _material(result: SearchResult, drawn: Floats, calibrated: Calibrated, twin: Twin, date: day) -> Material | None:
    """Return the calibrated material, or None for a curve or a flow law that a material file cannot contain."""
    fluid, best = twin.trial.fluid, settings_at(result.frees, result.best)
    key = next((name.partition(".")[2] for name in THICKNESS if name in best), None) or (fluid and fluid.given_by)
    if fluid is None or fluid.curve is not None or key is None or LAWS[key].law not in KEY_OF_LAW:
        return None
    health = twin.health
    draws = {free.name: free.values(column) for free, column in zip(result.frees, drawn.T, strict=True)}
    declared = twin.trial.uncertainty
    stress_pa = best.get(STRESS, fluid.yield_stress_pa)
    low_pa, high_pa, error_pa = stress_pa, stress_pa, declared.yield_stress_pa or 0.0
    if STRESS in draws:
        low_pa, high_pa, error_pa = _spread(draws[STRESS], stress_pa)
    thick_pa_s, percent = health.viscosity_pa_s, declared.viscosity_percent or 0.0
    if free := [draws[name] for name in THICKNESS if name in draws]:
        percent = 100 * float(np.std(np.log(np.maximum(free[0], 1e-9))))
    basis = ["readings that were not measured (EMULATED)"] if calibrated.emulated else []
    basis.append(f"joint distribution: {POSTERIOR}; the numbers here are its most likely draw")
    if not error_pa:
        basis.append("the yield stress was not free and has no stated uncertainty, so it has no interval")
    # The run records the viscosity at a shear rate of 1/s, which is K.
    law: dict[str, Any] = {KEY_OF_LAW[LAWS[key].law]: float(f"{thick_pa_s:.6g}") if thick_pa_s else None}
    if "consistency_pa_s_n" in law:
        law["flow_index"] = best.get(INDEX, fluid.flow_index)
        if INDEX in draws:
            law["flow_index_95"] = _spread(draws[INDEX], best[INDEX])[:2]
    if others := [f"{name} = {value:g}" for name, value in best.items() if name not in (STRESS, INDEX, *THICKNESS)]:
        basis.append(f"fitted together with {', '.join(others)}: use these values too")
    if unidentified := [marginal.free.name for marginal in calibrated.marginals if not marginal.identified]:
        basis.append(f"not identified by the readings: {', '.join(unidentified)}")
    return Material(
        method=f"calibration on {len(result.levels_mm)} trial(s), {len(result.points)} runs each",
        date=date.isoformat(),
        data="synthetic" if calibrated.emulated else "measured",
        yield_stress_pa=stress_pa,
        yield_stress_error_pa=error_pa,
        yield_stress_95_pa=(low_pa, high_pa),
        **law,
        viscosity_error_percent=min(percent, 1000.0) if thick_pa_s else None,
        density_kg_m3=fluid.density_kg_m3,
        density_error_kg_m3=getattr(fluid.material, "density_error_kg_m3", 0.0),
        basis=tuple(sentence[:300] for sentence in basis),
        not_for=NOT_FOR,
        radius_mm=twin.radius_mm,
        substeps=health.substeps,
    )


def _spread(drawn: Floats, best: float) -> tuple[float, float, float]:
    """Return the ends of the 95 % interval of random draws, and the standard uncertainty.

    The interval is widened, if necessary, to include the best value.
    """
    low, high = np.quantile(drawn, [0.025, 0.975])
    return float(f"{min(low, best):.6g}"), float(f"{max(high, best):.6g}"), float(f"{(high - low) / 4:.6g}")
