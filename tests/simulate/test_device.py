"""Devices: their choice, their kernels, and the doctor's self-test, whose result is known."""

import importlib
import os
import resource
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import warp as wp

import simulate.kernels
from sealtwin.core.errors import InputError
from simulate.device import SIDE, choose_device, touching_pairs, turns_of_a_recording
from simulate.kernels import run_module
from simulate.kernels.lanes import WARP
from simulate.kernels.pair_kernels import pair_kernels
from tests.support.paths import ROOT


def test_an_absent_device_is_refused_without_a_fallback():
    assert choose_device("auto") == ("cuda:0" if wp.get_cuda_device_count() else "cpu")
    with pytest.raises(InputError, match=r"cuda:7 is not on this machine. Give auto or one of cpu"):
        choose_device("cuda:7")


def device_code() -> list[Any]:
    """Every Warp module of simulate with kernels that a GPU runs."""
    files = sorted(Path(simulate.__path__[0], "kernels").glob("[!_]*.py"))
    by_file = [wp.get_module(importlib.import_module(f"simulate.kernels.{file.stem}").__name__) for file in files]
    by_file.append(run_module.MODULE)
    by_pairs = dict.fromkeys(kernel.module for group in pair_kernels(native=False) for kernel in _kernels_of(group))
    return [module for module in (*by_file, *by_pairs) if module.kernels]


def _kernels_of(group: Any) -> list[wp.Kernel]:
    if isinstance(group, wp.Kernel):
        return [group]
    return [kernel for part in (group.values() if isinstance(group, dict) else group) for kernel in _kernels_of(part)]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="Warp's CUDA compiler comes with its Linux wheels")
@pytest.mark.parametrize("arch", [80, 90])
@pytest.mark.parametrize("module", device_code(), ids=lambda module: module.name)
def test_the_device_code_compiles_for_cuda_without_a_gpu(module, arch, tmp_path):
    """The architectures are Ampere and Hopper. Tests marked gpu run the code."""
    wp.compile_aot_module(module, arch=arch, module_dir=tmp_path)
    assert list(tmp_path.glob(f"*.sm{arch}.cubin")) or list(tmp_path.glob(f"*.sm{arch}.ptx"))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="Warp's CUDA compiler comes with its Linux wheels")
def test_the_sums_over_pairs_compile_for_one_warp_per_particle(tmp_path, monkeypatch):
    """The test above compiles them for one thread per particle."""
    modules = {kernel.module for group in pair_kernels(native=False) for kernel in _kernels_of(group)}
    for module in modules:
        monkeypatch.setitem(module.options, "block_dim", int(WARP))
        wp.compile_aot_module(module, arch=90, module_dir=tmp_path)
    assert len(list(tmp_path.glob("*.sm90.*"))) == len(modules)


@pytest.mark.parametrize("lacking", ["is_conditional_graph_supported", "is_mempool_supported"])
def test_a_gpu_that_cannot_record_frames_is_refused(lacking, monkeypatch):
    """Its driver is too old, or it has no memory pools. The refusal proposes the CPU, which is not used by itself."""
    monkeypatch.setattr(wp, "get_devices", lambda: ["cpu", "cuda:0"])
    for name in ("is_conditional_graph_supported", "is_mempool_supported"):
        monkeypatch.setattr(wp, name, lambda *_, name=name: name != lacking)
    for asked in ("auto", "cuda", "cuda:0"):
        with pytest.raises(InputError, match=r"^device cuda:0: .*--device cpu"):
            choose_device(asked)
    assert choose_device("cpu") == "cpu"


def test_a_machine_without_a_gpu_gives_no_warning():
    """Warp's native code writes its warning past Python. Everything else written there is passed on."""
    script = "import os; from simulate.device import choose_device; choose_device('cpu'); os.write(2, b'after')"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True, cwd=ROOT)
    assert (done.stdout, done.stderr) == (b"", b"after")


def test_the_self_test_passes_unless_a_recording_fails(monkeypatch):
    assert touching_pairs("cpu") == 3 * 7 * 8 * 8
    assert turns_of_a_recording("cpu") == SIDE
    monkeypatch.setattr(wp, "capture_launch", lambda _: None)
    assert turns_of_a_recording("cpu") == 0


CACHES = ("WARP_CACHE_PATH", "XDG_CACHE_HOME")
SELFTEST = """
import sys
from sealtwin.core.errors import InputError
from simulate.device import choose_device, touching_pairs
try:
    print(touching_pairs(choose_device("cpu")))
except InputError as fault:
    sys.exit(print(fault) or 3)
"""


def selftest(cache: Path, largest_file_bytes: int | None = None, **environment: str) -> tuple[int, str]:
    """Run the kernels of the self-test; files may have ``largest_file_bytes``, beyond which writing fails."""

    def bound() -> None:
        if largest_file_bytes is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file_bytes, largest_file_bytes))

    cache_variable = {"WARP_CACHE_PATH": str(cache)} if cache.name else {}
    variables = {name: value for name, value in os.environ.items() if name not in CACHES} | cache_variable | environment
    done = subprocess.run(
        [sys.executable, "-c", SELFTEST], cwd=ROOT, env=variables, capture_output=True, text=True, preexec_fn=bound
    )
    assert "Traceback" not in done.stderr, done.stderr
    return done.returncode, done.stdout


@pytest.mark.slow
def test_a_kernel_cache_that_cannot_be_written_is_named_in_the_error(tmp_path):
    code, printed = selftest(tmp_path, largest_file_bytes=5_000)
    assert code == 3
    assert str(tmp_path) in printed
    assert "WARP_CACHE_PATH" in printed
