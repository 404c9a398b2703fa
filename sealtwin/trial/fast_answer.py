"""The fast model's answer to a digitised trial: in a second, for screening, before particles are computed."""

from sealtwin.core.errors import InputError
from sealtwin.core.records import Sample
from sealtwin.trial.trial_file import Trial


def fast_answer(trial: Trial, sample: Sample) -> list[str]:
    """Return sentences on level, underfill and overfill by the fast model, and on its domain.

    For a trial that the fast model cannot compute, the sentence has the reason.
    """
    from sealtwin.core.run_figures import FAST
    from simulate.slot.run import pour
    from validate.metrics.volumes import fill_volumes
    from validate.wording.headline import method_sentences

    fluid, solver, nozzle = trial.physics
    solver = solver.model_copy(update={"model": FAST})
    try:
        run, profile = pour(sample, fluid, solver, nozzle, seed=trial.seed, slope=trial.sample)
    except InputError as fault:
        return [f"The fast model cannot answer: {fault}"]
    volumes = fill_volumes(profile, sample.outline, sample.solid, 0.0, sample.outline.length_mm)
    level_mm = profile.level_mm
    return [
        f"By the fast model, for screening: level {level_mm.mean():.2f} mm on average, {level_mm.min():.2f} to "
        f"{level_mm.max():.2f} mm; {volumes['underfill_mm3']:.0f} mm3 are missing below the face and "
        f"{volumes['overfill_mm3']:.0f} mm3 are above it.",
        *method_sentences(run),
    ]
