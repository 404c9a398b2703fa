"""Check Warp's cache of compiled kernels: a full or read-only folder is an error that names it."""

import functools
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import warp as wp

from sealtwin.core.errors import InputError

NEEDED_BYTES = 20_000_000
"""Disk space that must be free: ten times the largest compiled module. LLVM ends the process if a disk is full."""
REMEDY = "Set WARP_CACHE_PATH to a writable folder with at least {needed:.0f} MB free."


@contextmanager
def naming_the_cache() -> Iterator[None]:
    """Convert an OSError into an InputError that names the cache and WARP_CACHE_PATH."""
    try:
        yield
    except OSError as fault:
        raise _unusable(fault.strerror or str(fault), fault.filename) from fault


def guard_kernel_cache() -> None:
    """Check the cache at each load of a module, which Warp does when a kernel is first launched."""
    if not hasattr(wp.Module.load, "__wrapped__"):
        wp.Module.load = _guarded(wp.Module.load)


def _guarded(load: Any) -> Any:
    @functools.wraps(load)
    def guarded(module: Any, device: Any, block_dim: int | None = None, *others: Any, **more: Any) -> Any:
        wanted = block_dim if block_dim is not None else module.options["block_dim"]
        if (wp.get_device(device).context, wanted) in module.execs:
            return load(module, device, block_dim, *others, **more)
        if not Path(wp.config.kernel_cache_dir or "", module.get_module_identifier(wanted)).is_dir():
            _require_room()
        with naming_the_cache():
            return load(module, device, block_dim, *others, **more)

    return guarded


def _require_room() -> None:
    """Raise InputError if the cache cannot take a module. Writes a file, because only that detects a quota."""
    with naming_the_cache(), tempfile.TemporaryFile(dir=wp.config.kernel_cache_dir) as probe:
        probe.write(bytes(NEEDED_BYTES))


def _unusable(reason: str, place: str | None = None) -> InputError:
    cache = place or wp.config.kernel_cache_dir or "the home folder"
    return InputError(
        f"{cache}: the cache of compiled kernels cannot be stored there ({reason}). "
        f"{REMEDY.format(needed=NEEDED_BYTES / 1e6)}"
    )
