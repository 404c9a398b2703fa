"""Ctrl-C while trimesh is imported, in a process of its own, since a process imports it once."""

import sys

import pytest

from tests.programs import start_interruptible

IMPORTING = """
import importlib.abc, signal, sys

class Interrupting(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name == "networkx":
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, Interrupting())
try:
    {load}
except KeyboardInterrupt:
    print("interrupted", "trimesh" in sys.modules)
else:
    print("swallowed")
"""


def _outcome(load):
    return start_interruptible([sys.executable, "-c", IMPORTING.format(load=load)]).communicate()[0].strip()


@pytest.mark.broad
def test_an_interrupt_waits_for_trimesh_and_is_not_lost():
    assert _outcome("import trimesh") == "swallowed", "trimesh keeps interrupts no more: load_trimesh can go"
    assert _outcome("from sealtwin.core.mesh_file import load_trimesh; load_trimesh()") == "interrupted True"
