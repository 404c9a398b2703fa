"""Measurements on a GPU are refused on a machine without a GPU."""

import pytest

from benchmarks import cuda_runs


def test_an_absent_device_is_refused_in_one_sentence_with_exit_code_3(capsys):
    with pytest.raises(SystemExit) as left:
        cuda_runs.main("cuda:7")
    assert left.value.code == 3
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("device cuda:7 is not on this machine. Give auto or one of cpu")
    assert printed.err.count("\n") == 1
