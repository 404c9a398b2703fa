"""Make a trial a draft for a search, and give each trial the particles and the fluid of its run."""

from collections.abc import Iterable

from sealtwin.core.records import Sample
from sealtwin.trial.trial_file import Trial

OF_ANY_DRAFT = ("solver.model", "solver.settle_s")
"""Settings of the solver that a draft leaves as they are."""


def sets_resolution(names: Iterable[str]) -> bool:
    """Return True if ``names`` has a setting of the solver that a draft would replace."""
    return any(name.startswith("solver.") and name not in OF_ANY_DRAFT for name in names)


def drafted(trial: Trial, sample: Sample) -> Trial:
    """Return a trial with preset "draft", as its run resolves it.

    A trial of the fast model or of another preset is returned as it is.
    """
    if not trial.solver.has_particles or trial.solver.preset != "accurate":
        return trial
    changes = {"preset": "draft", "pressure": "local", "substeps": None, "iterations": None}
    return as_run(trial.model_copy(update={"solver": trial.solver.model_copy(update=changes)}), sample)


def as_run(trial: Trial, sample: Sample) -> Trial:
    """Return a trial with the particle radius, U and D of its run. Raises InputError without a fluid."""
    from simulate.setup_checks import resolved

    fluid, solver = resolved(sample, trial.given_fluid, trial.solver, trial.nozzle)
    return trial.model_copy(update={"fluid": fluid, "solver": solver})
