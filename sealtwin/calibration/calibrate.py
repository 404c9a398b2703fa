"""Calibration of one trial or several, and the prediction of trials that are held out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date as day
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sealtwin.calibration import outputs
from sealtwin.calibration.search import DRAWS, Found, Source, search, settings_at
from sealtwin.calibration.twin import Twin
from sealtwin.core.errors import InputError, NumericalError
from sealtwin.core.progress import Progress, in_words
from sealtwin.core.records import Floats
from sealtwin.core.run_folder import holding, refuse_foreign, require_folder
from sealtwin.study.sweep import SweepOptions
from sealtwin.trial.trial_file import SETTINGS, load_trial, no_such_setting
from validate.calibration.free import Free
from validate.calibration.summary import Calibrated, Prediction, predicted_by_emulator, predicted_by_runs
from validate.figures.calibration_sheet import calibration_sheet
from validate.figures.figure_sheet import write_sheet_of_figures
from validate.units import counted

LIBRARY = "library"  # Folder of the runs of all trials, each in that of a study
PREDICTING = 12  # Draws of the posterior that run in a trial that is held out
MOST_FREE = 6  # Forty runs resolve no more
OF_A_POUR = ("path", "crack", "sample", "nozzle")  # Tables whose settings are another trial's own
LEAST_BUDGET = 40


@dataclass(frozen=True)
class Calibration:
    """Result of a calibration; its files are in the folder."""

    content: dict[str, Any]  # The --json object, and calibration.json
    calibrated: Sequence[Twin]
    held_out: Sequence[Twin]


def calibrate(
    files: Sequence[Path],
    ranges: Mapping[str, tuple[float, float]],
    out: Path | None,
    how: SweepOptions,
    progress: Progress,
    *,
    held_out: Sequence[Path] = (),
    budget: int = LEAST_BUDGET,
    date: day | None = None,
) -> Calibration:
    """Find the settings ``ranges`` of trials, by their readings, and write material, posterior, record and page.

    ``ranges`` gives the ends of each setting by dotted name; ``out`` None stands for reports/<trial>-calibrated. Runs
    that are made are kept: after a kill the same call goes on, and gives the same files.

    Raises:
        InputError: A trial, a setting or a role cannot be used, or the folder holds something else.
        NumericalError: A quarter of the runs has no result.
        BusyError: Another process works in the folder.
    """
    frees = _checked(files, ranges, held_out)
    folder = out or Path("reports", f"{load_trial(files[0]).folder_name}-calibrated")
    require_folder(folder)
    if folder.is_dir() and not (folder / LIBRARY).is_dir():
        refuse_foreign(folder, "calibration")
    with holding(folder), progress:
        twins, others = ([Twin(file, folder / LIBRARY, how, progress) for file in group] for group in (files, held_out))
        _require_different([*twins, *others])
        frees = [Free(free.name, free.low, free.high, _measured(free, twins)) for free in frees]
        for twin in twins:
            twin.require(frees)

        def say(text: str) -> None:
            spent_s = [run.wall_s for twin in twins for run in twin.plan.runs if run.wall_s is not None]
            left = sum(budget - len(twin.plan.runs) for twin in twins) * float(np.mean(spent_s)) / max(1, how.jobs)
            progress.note(f"{text} About {in_words(left)} of runs left.")

        found = search(frees, [Source(twin.name, twin.evidence, twin.run) for twin in twins], budget, say)
        predictions = [_fitted(found, twin, number) for number, twin in enumerate(twins)] if found.possible else []
        predictions += [_predicted(found, twin) for twin in others] if found.possible else []
        calibrated = _summary(found, twins, others, predictions)
        content = outputs.write(folder, found, calibrated, twins, others, date or day.today())
        content["files"] += write_sheet_of_figures(folder, outputs.PAGE, calibration_sheet(calibrated))
        outputs.write_record(folder, content)
        return Calibration(content, twins, others)


def _checked(files: Sequence[Path], ranges: Mapping[str, tuple[float, float]], held_out: Sequence[Path]) -> list[Free]:
    if not 1 <= len(ranges) <= MOST_FREE:
        raise InputError(f"{len(ranges)} free settings: give 1 to {MOST_FREE}; {LEAST_BUDGET} runs resolve no more.")
    for name, (low, high) in ranges.items():
        if name not in SETTINGS:
            raise InputError(f"--free {no_such_setting(name)}.")
        if not low < high:
            raise InputError(f"--free {name}={low:g}:{high:g}: the first end must be below the second.")
        if len(files) > 1 and name.partition(".")[0] in OF_A_POUR:
            raise InputError(
                f"--free {name}: is another number in each of {len(files)} pours, and they share the free settings. "
                "Measure it, and leave it out; or calibrate one trial."
            )
    roles: dict[Literal["held-out", "calibrated-on"], Sequence[Path]] = {"held-out": files, "calibrated-on": held_out}
    for wrong, group in roles.items():
        for file in group:
            readings = load_trial(file).readings
            if readings is not None and readings.role == wrong:
                right = "calibrated-on" if wrong == "held-out" else "held-out"
                raise InputError(
                    f'{file}: readings.role = "{wrong}", and this calibration would use them as {right}. Write '
                    f'"{right}", or give another trial.'
                )
    return [Free(name, low, high) for name, (low, high) in ranges.items()]


def _require_different(twins: Sequence[Twin]) -> None:
    for number, twin in enumerate(twins):
        for other in twins[:number]:
            same = np.array_equal(twin.readings.level_mm, other.readings.level_mm)
            if twin.folder == other.folder or (same and np.array_equal(twin.readings.s_mm, other.readings.s_mm)):
                what = "name" if twin.folder == other.folder else "readings"
                raise InputError(f"{twin.file}: has the {what} of {other.file}; give each trial once, by its own name.")


def _measured(free: Free, twins: Sequence[Twin]) -> tuple[float, float] | None:
    """Return value and uncertainty of a setting that was measured, the same in all trials, or None."""
    known = {twin.measured(free.name) for twin in twins}
    if len(known) > 1:
        raise InputError(
            f"--free {free.name}: the trials have different measured values or uncertainties of it, and they share the "
            "free settings. Give them the same, or calibrate them one by one."
        )
    measured = known.pop()
    if measured is not None and not free.low <= measured[0] <= free.high:
        raise InputError(
            f"--free {free.name}={free.low:g}:{free.high:g}: the trial's own {measured[0]:g}, which was measured to "
            f"{measured[1]:g}, lies outside. Give a range around it."
        )
    return measured


def _fitted(found: Found, twin: Twin, number: int) -> Prediction:
    assert found.draws is not None, "asked only where there is a posterior"
    return _prediction(
        twin, "calibrated", *predicted_by_emulator(found.posterior.emulators[number], twin.evidence, found.draws)
    )


def _predicted(found: Found, twin: Twin) -> Prediction:
    """Run draws of the posterior in a trial that is held out; a pour keeps its own path and crack."""
    assert found.draws is not None, "asked only where there is a posterior"
    chosen = found.draws[np.linspace(0, DRAWS - 1, PREDICTING).astype(int)]
    settings = [settings_at(found.frees, point) for point in chosen]
    own = [{name: one[name] for name in one if name.partition(".")[0] not in OF_A_POUR} for one in settings]
    levels_mm = [level for level in twin.run([(one, seed) for seed, one in enumerate(own)]) if level is not None]
    if len(levels_mm) < PREDICTING // 2:
        raise NumericalError(
            f"{twin.name}: {PREDICTING - len(levels_mm)} of {PREDICTING} runs of the trial that is held out failed or "
            f"lost over 5 % of their volume: {'; '.join(sorted({reason for _, reason in twin.unused()}))}"
        )
    return _prediction(twin, "held out", *predicted_by_runs(np.array(levels_mm), twin.evidence))


def _prediction(twin: Twin, role: Literal["calibrated", "held out"], mean_mm: Floats, half_mm: Floats) -> Prediction:
    evidence = twin.evidence
    error_mm = 1.96 * np.sqrt(evidence.covariance_mm2.diagonal())
    return Prediction(twin.name, role, twin.held.data, evidence.s_mm, evidence.level_mm, error_mm, mean_mm, half_mm)


def _summary(
    found: Found, twins: Sequence[Twin], others: Sequence[Twin], predictions: Sequence[Prediction]
) -> Calibrated:
    warned = [sentence for twin in (*twins, *others) for sentence in twin.warnings]
    if len(found.frees) >= (stations := sum(twin.stations for twin in twins)):
        read = f"{counted(len(found.frees), 'setting')} free, and {counted(stations, 'station')} read"
        warned.append(f"{read}: so many settings can fit any readings exactly.")
    return Calibrated(
        name=" and ".join(twin.name for twin in twins),
        emulated=any(twin.held.data != "measured" for twin in twins),
        frees=tuple(found.frees),
        draws=found.draws,
        best=found.best,
        runs=len(found.points),
        unused=tuple((twin.name, *one) for twin in twins for one in twin.unused()),
        reaches=tuple(zip((twin.name for twin in twins), found.reaches, strict=True)),
        least_implausibility=found.least_implausibility,
        mixing=found.mixing,
        discrepancy_mm=found.discrepancy_mm,
        run_noise_mm=tuple(
            float(np.sqrt(emulator.run_noise_mm2.diagonal().mean() * emulator.processes.relative.mean()))
            for emulator in found.posterior.emulators
        ),
        predictions=tuple(predictions),
        radius_mm=tuple(twin.radius_mm for twin in twins),
        warned=tuple(warned),
    )
