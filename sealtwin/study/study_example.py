"""A commented study file to start from, for 'sealtwin sweep --example FILE'."""

from pathlib import Path

from sealtwin.errors import InputError
from sealtwin.store.files import write_text

STUDY = """\
# A study: one trial run many times, each time with other settings.
# First look at what it would take:  sealtwin sweep {file} --dry-run
# Then leave it to itself:           sealtwin sweep {file}
# From another terminal:             sealtwin sweep status reports/yield-stress
# Killed, switched off or interrupted, the same command goes on with what is left.

name = "yield-stress"             # also of its folder under reports/
trial = "trial.toml"              # beside this file; 'sealtwin init DIR' writes one to start from

# Settings by dotted name: "seed", and all of [fluid], [solver], [nozzle], [path] and [crack] of the trial.
[fixed]                           # in all runs, in place of the trial's own
"solver.radius_mm" = 0.6          # half as coarse again as 0.4 mm, and three times as quick

# One of three: [grid], [list] or [latin].
[grid]                            # each value with each: 4 x 2 = 8 runs
"fluid.yield_stress_pa" = [0.0, 5.0, 10.0, 20.0]
"fluid.D_cm" = [0.1, 0.3]

# [list]                          # runs one by one
# columns = ["fluid.yield_stress_pa", "path.speed_mm_s"]
# rows = [[5.0, 4.0], [10.0, 6.0]]

# [latin]                         # a Latin hypercube: every range is covered evenly, however few the runs
# count = 40
# seed = 1
# [latin.ranges]
# "fluid.yield_stress_pa" = {{ low = 1.0, high = 40.0, scale = "log" }}
# "path.speed_mm_s" = {{ low = 2.0, high = 8.0 }}
# "solver.iterations" = {{ low = 2, high = 10, whole = true }}
"""


def write_example_study(file: Path) -> None:
    """Raises InputError where something lies there already."""
    if file.exists():
        raise InputError(f"{file}: is there already and is not overwritten; give another name.")
    write_text(file, STUDY.format(file=file))
