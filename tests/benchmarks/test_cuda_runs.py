"""The measuring of a GPU, on a machine that has none."""

import pytest

from benchmarks import cuda_runs


def test_a_device_that_is_not_here_is_one_sentence_and_the_commands_code(capsys):
    with pytest.raises(SystemExit) as left:
        cuda_runs.main("cuda:7")
    assert left.value.code == 3
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("device cuda:7 is not on this machine. Give auto or one of cpu")
    assert printed.err.count("\n") == 1
