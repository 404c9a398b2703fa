import pytest
import warp as wp

from sealtwin.errors import InputError
from simulate.device import choose_device, describe_device


def test_auto_takes_a_gpu_where_there_is_one_and_the_cpu_elsewhere():
    assert choose_device("auto") == ("cuda:0" if wp.get_cuda_device_count() else "cpu")


def test_an_absent_device_is_an_error_and_no_fallback():
    with pytest.raises(InputError, match=r"cuda:7 is not here; allowed are auto and cpu"):
        choose_device("cuda:7")


def test_the_description_names_the_kind_of_device():
    assert "CPU" in describe_device("cpu")
