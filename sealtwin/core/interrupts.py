"""Ctrl-C where a library would swallow it."""

import signal
import sys
import threading


def load_trimesh() -> None:
    """Import trimesh with Ctrl-C held back until it is there.

    It catches every exception of its own imports, an interrupt too, after which a run would go on as if never asked.
    """
    if "trimesh" in sys.modules or threading.current_thread() is not threading.main_thread():
        return
    held = list[int]()
    before = signal.signal(signal.SIGINT, lambda number, _: held.append(number))
    try:
        import trimesh  # noqa: F401  # pyright: ignore[reportUnusedImport]
    finally:
        signal.signal(signal.SIGINT, before or signal.default_int_handler)
    if held:
        signal.raise_signal(signal.SIGINT)
