import sys

import pytest
import warp as wp

from sealtwin.errors import InputError
from simulate import kernels, kernels_distance, kernels_viscosity
from simulate.device import choose_device, describe_device


def test_auto_takes_a_gpu_where_there_is_one_and_the_cpu_elsewhere():
    assert choose_device("auto") == ("cuda:0" if wp.get_cuda_device_count() else "cpu")


def test_an_absent_device_is_an_error_and_no_fallback():
    with pytest.raises(InputError, match=r"cuda:7 is not here; allowed are auto and cpu"):
        choose_device("cuda:7")


def test_the_description_names_the_kind_of_device():
    assert "CPU" in describe_device("cpu")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="Warp's CUDA compiler comes with its Linux wheels")
@pytest.mark.parametrize("module", [kernels, kernels_distance, kernels_viscosity])
def test_the_device_code_compiles_for_cuda_without_a_gpu(module, tmp_path):
    """Hopper's architecture. That it runs there is for the tests marked gpu."""
    wp.compile_aot_module(module, arch=90, module_dir=tmp_path)
    assert list(tmp_path.glob("*.sm90.cubin")) or list(tmp_path.glob("*.sm90.ptx"))
