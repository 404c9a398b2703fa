"""The cache of compiled kernels, damaged, full or without a place: each in a process and with a cache of its own."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT

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

    own = {"WARP_CACHE_PATH": str(cache)} if cache.name else {}
    given = {name: value for name, value in os.environ.items() if name not in CACHES} | own | environment
    done = subprocess.run(
        [sys.executable, "-c", SELFTEST], cwd=ROOT, env=given, capture_output=True, text=True, preexec_fn=bound
    )
    assert "Traceback" not in done.stderr, done.stderr
    return done.returncode, done.stdout


@pytest.mark.slow
def test_a_damaged_kernel_is_compiled_again(tmp_path):
    """As after a power cut: the object cut short, or its description; a second run finds the cache whole."""
    assert selftest(tmp_path) == (0, "1344\n")
    for ending, bytes_left in ((".o", 1000), (".o", 0), (".meta", 3)):
        (damaged,) = tmp_path.rglob(f"*{ending}")
        whole = damaged.stat().st_size
        os.truncate(damaged, bytes_left)
        assert selftest(tmp_path) == (0, "1344\n")
        (mended,) = tmp_path.rglob(f"*{ending}")
        assert mended.stat().st_size == whole


@pytest.mark.slow
def test_a_cache_that_cannot_grow_is_named(tmp_path):
    code, printed = selftest(tmp_path, largest_file_bytes=5_000)
    assert code == 3
    assert str(tmp_path) in printed
    assert "WARP_CACHE_PATH" in printed


def test_a_home_that_can_hold_no_cache_is_named():
    code, printed = selftest(Path(), HOME="/dev/null")
    assert code == 3
    assert printed.startswith("/dev/null")
    assert "WARP_CACHE_PATH" in printed
