"""Watchers of a run: frames at given times, and checkpoints from which it is resumed bit for bit."""

import io
import random
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from sealtwin.core.vtk_files import ParticleState
from simulate.injection import Injection
from simulate.kernels import status
from simulate.settings import Fluid
from simulate.watchers import Checkpoint, Moments
from tests.support.small_fluids import injected, path, results, slot

FREEZING = Fluid(U=30.0, D_cm=0.3, freeze_after_s=0.2)
CARRYING = Fluid(viscosity_pa_s=0.5, freeze_after_s=0.2)
YIELDING = Fluid(viscosity_pa_s=0.05, yield_stress_pa=60.0, structuration_pa_per_s=5.0, freeze_after_s="never")


def injection(fluid: Fluid, volume_ml: float = 0.12, **solver: Any) -> Injection:
    crack = slot(12.0)
    way = path(crack[1], volume_ml, speed_mm_s=20.0)
    return injected(crack, way, fluid, seed=1, **{"radius_mm": 0.6, "settle_s": 0.6, **solver})


def finish(run: Injection) -> None:
    while run.done < run.frames and not run.at_rest:
        run.advance()


def bits(run: Injection) -> dict[str, bytes]:
    """Return the bytes of the snapshot's arrays, except computing times."""
    return {name: kept.tobytes() for name, kept in run.snapshot().items() if name != "seen_frames_s"}


class Killed:
    """The same run in parts, each of which begins with a new solver at the last part's checkpoint."""

    def __init__(self, file: Path, fluid: Fluid, **solver: Any) -> None:
        self.sentences: list[str] = []
        self._file, self._fluid, self._solver = file, fluid, solver

    def go_on(self, until: int) -> Injection:
        run = injection(self._fluid, **self._solver)
        checkpoint = Checkpoint(self._file, "key", self.sentences.append)
        checkpoint.begin(run)
        while run.done < min(until, run.frames) and not run.at_rest:
            run.advance()
        checkpoint.keep(run)
        return run


@pytest.mark.parametrize(
    ("fluid", "solver"),
    [
        (YIELDING, {}),
        (FREEZING, {}),
        (CARRYING, {}),
        (YIELDING, {"sleep": False}),
        (FREEZING, {"viscosity_solve": "explicit"}),
    ],
)
def test_a_run_killed_at_random_frames_and_resumed_equals_the_unbroken_run(tmp_path, fluid, solver):
    """It is killed once as it fills and once as it comes to rest, and is bit-identical in the end.

    Broken on purpose without any one of the arrays in ``lasting``, at least one of the cases fails.
    """
    unbroken = injection(fluid, **solver)
    finish(unbroken)
    killed = Killed(tmp_path / "checkpoint.npz", fluid, **solver)
    moments = random.Random(4)
    for low, high in ((0.1, 0.6), (0.8, 0.98)):
        killed.go_on(int(moments.uniform(low, high) * unbroken.done))
    last = killed.go_on(unbroken.frames)
    assert len(killed.sentences) == 2
    assert all("continues after frame" in sentence for sentence in killed.sentences)
    assert bits(last) == bits(unbroken)
    if solver != {"sleep": False}:
        # Particles froze or slept on the way; otherwise the test would show less than it claims.
        assert unbroken.statistics.moving[-1] < 0.8 * max(unbroken.statistics.moving)
    assert results(last)[0].position_mm.tobytes() == results(unbroken)[0].position_mm.tobytes()


@pytest.fixture(scope="module")
def begun() -> bytes:
    """A checkpoint after five frames."""
    with TemporaryDirectory() as folder:
        Killed(Path(folder) / "checkpoint.npz", FREEZING).go_on(5)
        return (Path(folder) / "checkpoint.npz").read_bytes()


@pytest.fixture(scope="module")
def fresh() -> Injection:
    """A run at its first frame, which no test advances."""
    return injection(FREEZING)


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "other size", "bare", "another run"])
def test_a_damaged_or_foreign_checkpoint_is_reported_and_the_run_starts_again(begun, fresh, tmp_path, damage):
    file, sentences, before = tmp_path / "checkpoint.npz", list[str](), bits(fresh)
    content = {
        "cut": begun[: len(begun) // 2],
        "flip": begun[:3000] + bytes([begun[3000] ^ 1]) + begun[3001:],
        "empty": b"",
    }
    file.write_bytes(content.get(damage, begun))
    if damage in ("other size", "bare"):
        arrays = dict(np.load(io.BytesIO(begun)))
        shorter = arrays | {"position": arrays["position"][:-1]}
        np.savez(file, allow_pickle=False, **(shorter if damage == "other size" else {}))
    Checkpoint(file, "another" if damage == "another run" else "key", sentences.append).begin(fresh)
    (sentence,) = sentences
    assert sentence.startswith(f"checkpoint.npz: is {'from a run' if damage == 'another run' else 'damaged ('}")
    assert sentence.endswith("; the fluid run starts again at its first frame.")
    assert "\n" not in sentence
    assert (fresh.done, bits(fresh)) == (0, before)


def brief(volume_ml: float = 0.12) -> Injection:
    return injection(FREEZING, volume_ml, settle_s=0.1)


def followed(run: Injection, *watchers, frames: int | None = None) -> None:
    for watcher in watchers:
        watcher.begin(run)
    for _ in range(run.frames - run.done if frames is None else frames):
        run.advance()
        for watcher in watchers:
            watcher.after_frame(run)


def test_particle_states_have_the_same_numbers_on_host_and_device():
    assert {state.name: state.value for state in ParticleState} == {
        state.name: int(getattr(status, state.name)) for state in ParticleState
    }


def test_a_snapshot_is_taken_at_the_first_frame_after_each_requested_time():
    """The times are 0, two within one frame, one just past the end, and one far past the end, which is left out."""
    run, taken = brief(), []
    end_s = run.frames * run.schedule.frame_s
    wanted = [0.0, 0.1, 0.1001, 0.3, 1.01 * end_s]
    followed(run, Moments([*wanted, 1.5 * end_s], lambda asked_s, frame: taken.append((asked_s, frame.t_s))))
    assert [asked_s for asked_s, _ in taken] == wanted
    for asked_s, t_s in taken[1:-1]:
        assert 0 <= t_s - asked_s < run.schedule.frame_s
    assert (taken[0][1], taken[-1][1]) == (run.schedule.frame_s, run.t_s)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="Linux tells what is resident")
@pytest.mark.parametrize("replays", [False, True])
def test_resident_memory_does_not_grow_over_a_run(replays):
    """Memory outside Python objects is included. A separate process computes 1,500 frames after 300 to warm up.

    The limit is half a page of 4 kB per frame. Measured are 0.9 MB; 0.0 if replayed.
    """
    code = (
        "import ctypes, gc; from pathlib import Path\n"
        "from tests.support.batches import *\n"
        "def resident():\n"
        "    gc.collect()\n"
        # Otherwise a leak could fill memory that the set-up left free.
        "    ctypes.CDLL(None).malloc_trim(0)\n"
        "    return int(Path('/proc/self/statm').read_text().split()[1]) * 4096\n"
        "how = dict(radius_mm=0.6, substeps=19, settle_s=30.0, sleep=False, volume_factor=1.1)\n"
        f"run = ready(PASTES, seed=1, replays={replays}, **how)\n"
        "[run.advance() for _ in range(300)]; before = resident(); [run.advance() for _ in range(1500)]\n"
        "assert run.done == 1800 and run.moving; print(resident() - before)"
    )
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert int(printed.splitlines()[-1]) < 1500 * 2048
