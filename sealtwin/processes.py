"""Processes that work for another one."""

import os
import threading
from multiprocessing import parent_process


def end_with_parent() -> None:
    """Called in a child. A parent that is killed cannot tell its processes: they would wait for work for ever."""
    parent = parent_process()
    assert parent is not None, "called in a process that another one started"

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
