"""Studies as job arrays of a batch system: the script that submits the shards, and the merge of their folders."""

import shlex
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.run_folder import holding
from sealtwin.study.study_file import load_study
from sealtwin.study.study_folder import (
    OUTCOME,
    Plan,
    StudyRun,
    holds_study,
    is_intact,
    read_plan,
    run_path,
    write_outcome,
    write_plan,
)
from sealtwin.study.sweep import report, require_own
from sealtwin.trial.job import DIGITISED

HIDDEN = shutil.ignore_patterns(".*", OUTCOME)
"""Files that are not copied: locks, files of a killed process, and the outcome, which must be written last."""
BatchSystem = Literal["slurm", "pbs", "sge", "lsf"]
DIRECTIVES: dict[BatchSystem, tuple[str, str, str]] = {
    "slurm": (
        "#SBATCH --job-name={name}\n#SBATCH --array=1-{shards}\n#SBATCH --cpus-per-task={jobs}",
        "SLURM_ARRAY_TASK_ID",
        "SLURM_SUBMIT_DIR",
    ),
    "pbs": ("#PBS -N {name}\n#PBS -J 1-{shards}\n#PBS -l select=1:ncpus={jobs}", "PBS_ARRAY_INDEX", "PBS_O_WORKDIR"),
    "sge": ("#$ -N {name}\n#$ -t 1-{shards}\n#$ -pe smp {jobs}", "SGE_TASK_ID", "SGE_O_WORKDIR"),
    "lsf": ('#BSUB -J "{name}[1-{shards}]"\n#BSUB -n {jobs}\n#BSUB -R "span[hosts=1]"', "LSB_JOBINDEX", "LS_SUBCWD"),
}
"""Head of the script, and the environment variables for the number of the job and the folder it was submitted from."""
SCRIPT = """\
#!/bin/bash
{head}
# Add the time limit, queue and environment that your cluster asks for. A job that is killed or hits its time limit is
# submitted again as it is: finished runs are kept. When all jobs have ended:
#   sealtwin sweep merge {out}-*-of-{shards} --out {out}
set -euo pipefail
cd "${folder}"
shard="${task}"
exec sealtwin sweep {study} --shard "$shard/{shards}" --out {out}-"$shard"-of-{shards} --jobs {jobs} --quiet
"""


def batch_script(system: BatchSystem, file: Path, out: Path | None, shards: int, jobs: int) -> str:
    """Return a script for a job array that computes a study in shards. Raises InputError if the study is faulty."""
    study = load_study(file)
    if shards > study.runs:
        raise InputError(f"--shards {shards}: the study has {study.runs} runs, so at most as many shards.")
    head, task, folder = DIRECTIVES[system]
    return SCRIPT.format(
        head=head.format(name=study.folder_name, shards=shards, jobs=jobs),
        out=shlex.quote((out or Path("reports", study.folder_name)).as_posix()),
        study=shlex.quote(file.as_posix()),
        shards=shards,
        jobs=jobs,
        task=task,
        folder=folder,
    )


def merge(folders: Sequence[Path], out: Path) -> dict[str, Any]:
    """Join shards of a study in a folder that a sweep can continue, and return the --json object of the command.

    A run that several shards hold is taken from one that finished it.

    Raises:
        InputError: The folders hold different studies, or shards that were digitised or planned differently; or
            ``out`` is one of them, or holds something else.
    """
    if out.resolve() in {folder.resolve() for folder in folders}:
        raise InputError(f"--out {out}: is one of the folders to be merged; give another one.")
    require_own(out)
    with holding(out):
        sources = [*folders, out] if holds_study(out) else folders
        plans = [read_plan(folder) for folder in sources]
        chosen = _chosen(sources, plans)
        _refuse_different_samples(sources)
        plan = replace(plans[0], runs=[run for _, run in chosen])
        write_plan(out, plan)
        for folder in folders:
            files.write_if_new(out / "study.toml", (folder / "study.toml").read_bytes())
            shutil.copytree(folder / "samples", out / "samples", ignore=HIDDEN, dirs_exist_ok=True)
        for folder, run in chosen:
            if folder != out and run.state == "done":
                home, target = run_path(folder, run.key), run_path(out, run.key)
                shutil.copytree(home, target, ignore=HIDDEN, dirs_exist_ok=True)
            if run.state != "waiting":
                write_outcome(out, run)
        return report(out, plan)


def _chosen(folders: Sequence[Path], plans: Sequence[Plan]) -> list[tuple[Path, StudyRun]]:
    """Return every run once, in the order of the study, with a folder that holds its result if there is one."""
    first = plans[0]
    chosen: dict[int, tuple[Path, StudyRun]] = {}
    for folder, plan in zip(folders, plans, strict=True):
        if (plan.study, plan.total) != (first.study, first.total):
            raise InputError(
                f"{folder}: holds '{plan.study}' of {plan.total} runs, {folders[0]} holds '{first.study}' of "
                f"{first.total}; only shards of one study can be merged."
            )
        for run in plan.runs:
            held = chosen.setdefault(run.number, (folder, run))[1]
            if held.key != run.key:
                raise InputError(f"{folder}: run {run.number} has other settings or inputs than in {folders[0]}.")
            if held.state != "done" and is_intact(folder, run):
                chosen[run.number] = folder, run
    return [chosen[number] for number in sorted(chosen)]


def _refuse_different_samples(folders: Sequence[Path]) -> None:
    seen: dict[tuple[str, str], tuple[str, Path]] = {}
    for path in (path for folder in folders for name in DIGITISED for path in (folder / "samples").glob(f"*/{name}")):
        digest = files.sha256(path)
        other, first = seen.setdefault((path.parent.name, path.name), (digest, path))
        if other != digest:
            raise InputError(
                f"{path}: differs from {first}; the shards were digitised by different versions or machines. Compute "
                "them again from one."
            )
