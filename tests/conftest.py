"""One thread a process for the numerical libraries, before any of them is imported.

Two processes share the tests, and the cores: threads of a library wait for each other there, which takes processor
time and brings nothing.
"""

import gc
import os

for name in ("OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
    os.environ.setdefault(name, "1")


def pytest_collection_finish() -> None:
    """Leave the collected tests out of every later garbage collection: they stay until the end."""
    gc.freeze()
