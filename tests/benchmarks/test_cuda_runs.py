"""The measuring of a GPU, on a machine that has none."""

import pytest

from benchmarks import cuda_runs
from benchmarks.table import finish


def test_a_device_that_is_not_here_is_one_sentence_and_the_commands_code(capsys):
    with pytest.raises(SystemExit) as left:
        cuda_runs.main("cuda:7")
    assert left.value.code == 3
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("device cuda:7 is not on this machine. Give auto or one of cpu")
    assert printed.err.count("\n") == 1


@pytest.mark.slow
def test_on_the_cpu_all_targets_are_met_and_it_is_the_cpu_itself(capsys):
    """Coarse, and two of the 132 pairs, the first and the last: the thinnest fluid and the stiffest."""
    with pytest.raises(SystemExit) as left:
        finish(cuda_runs.main("cpu", runs=2, radius_mm=0.75))
    *table, counted = capsys.readouterr().out.splitlines()
    assert left.value.code == 0, table
    assert counted.endswith("targets met")
    figures = {line[:52].strip(): float(line[52:63]) for line in table[2:]}
    assert figures["2 runs: particles each"] > 2000
    assert figures["device and CPU"] == 0
    # Where a nudge moves runs no further than itself, it measures no chaos.
    assert figures["CPU runs, the nozzle 1e-06 mm apart"] > 1e-3
