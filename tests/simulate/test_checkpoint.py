"""A run that is killed and goes on is the unbroken one, bit for bit."""

import io
import random
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from sealtwin.core.progress import Progress
from simulate.injection import Injection, prepare
from simulate.output import Checkpoint, HealthLog
from simulate.run import follow
from simulate.settings import Fluid, Nozzle, Solver
from tests.fluids import path, slot

FREEZING = Fluid(U=30.0, D_cm=0.3, freeze_after_s=0.2)
CARRYING = Fluid(viscosity_pa_s=0.5, freeze_after_s=0.2)
YIELDING = Fluid(viscosity_pa_s=0.05, yield_stress_pa=60.0, structuration_pa_per_s=5.0, freeze_after_s="never")


def injection(fluid: Fluid, **solver: Any) -> Injection:
    solid, outline = slot(12.0)
    settings = Solver.model_validate({"radius_mm": 0.6, "settle_s": 0.6, **solver})
    trajectory = path(outline, 0.12, speed_mm_s=20.0)
    return prepare(solid, outline, trajectory, [fluid], settings, Nozzle(), seed=1, device="cpu")


def finish(run: Injection) -> None:
    while run.done < run.frames and not run.at_rest:
        run.advance()


def bits(run: Injection) -> dict[str, bytes]:
    """Of everything that lasts and of what was seen, computing time apart."""
    return {name: kept.tobytes() for name, kept in run.snapshot().items() if name != "seen_frames_s"}


class Killed:
    """The same run in pieces, each of which begins with a new solver from what the last one kept."""

    def __init__(self, file: Path, fluid: Fluid, **solver: Any) -> None:
        self.said: list[str] = []
        self._file, self._fluid, self._solver = file, fluid, solver

    def go_on(self, until: int) -> Injection:
        run = injection(self._fluid, **self._solver)
        checkpoint = Checkpoint(self._file, "key", self.said.append)
        checkpoint.begin(run)
        while run.done < min(until, run.frames) and not run.at_rest:
            run.advance()
        checkpoint.keep(run)
        return run


@pytest.mark.parametrize(
    ("fluid", "solver"),
    [
        (FREEZING, {}),
        (CARRYING, {}),
        (YIELDING, {}),
        (YIELDING, {"sleep": False}),
        (FREEZING, {"viscosity_solve": "explicit"}),
    ],
)
def test_a_run_killed_at_random_frames_is_the_unbroken_one_to_the_bit(tmp_path, fluid, solver):
    """Once as it fills, once as it comes to rest and some particles already lie; nothing may be left out of the file.

    Broken on purpose without any one of the arrays in ``lasting``, at least one of these fails.
    """
    unbroken = injection(fluid, **solver)
    finish(unbroken)
    killed = Killed(tmp_path / "checkpoint.npz", fluid, **solver)
    moments = random.Random(4)
    for low, high in ((0.1, 0.6), (0.8, 0.98)):
        killed.go_on(int(moments.uniform(low, high) * unbroken.done))
    last = killed.go_on(unbroken.frames)
    assert len(killed.said) == 2
    assert all("going on after frame" in said for said in killed.said)
    assert bits(last) == bits(unbroken)
    if solver != {"sleep": False}:
        # Particles froze or slept on the way: otherwise this would not hold what it says.
        assert unbroken.statistics.moving[-1] < 0.8 * max(unbroken.statistics.moving)
    assert last.results()[0].position_mm.tobytes() == unbroken.results()[0].position_mm.tobytes()


@pytest.fixture(scope="module")
def begun() -> bytes:
    """A checkpoint after five frames."""
    with TemporaryDirectory() as folder:
        Killed(Path(folder) / "checkpoint.npz", FREEZING).go_on(5)
        return (Path(folder) / "checkpoint.npz").read_bytes()


@pytest.fixture(scope="module")
def fresh() -> Injection:
    """No test moves it on."""
    return injection(FREEZING)


def test_a_run_that_has_begun_counts_who_moves_in_a_later_state():
    """More particles are out there than it has released itself."""
    later, begun_run = injection(YIELDING), injection(YIELDING)
    for run, frames in ((later, 12), (begun_run, 2)):
        for _ in range(frames):
            run.advance()
    assert later.out > begun_run.out
    begun_run.restore(later.snapshot())
    assert begun_run.moving == later.moving > 0


def test_a_checkpoint_of_another_run_is_said_and_not_used(begun, fresh, tmp_path):
    (tmp_path / "checkpoint.npz").write_bytes(begun)
    said = []
    Checkpoint(tmp_path / "checkpoint.npz", "another key", said.append).begin(fresh)
    assert fresh.done == 0
    assert said == [
        "checkpoint.npz: kept by a run with other settings, inputs or device; the fluid run starts again at its first "
        "frame."
    ]


@pytest.mark.parametrize("damage", ["cut", "flip", "text", "empty", "other size", "bare"])
def test_a_damaged_checkpoint_is_one_sentence_and_a_fresh_start(begun, fresh, tmp_path, damage):
    file = tmp_path / "checkpoint.npz"
    content = {
        "cut": begun[: len(begun) // 2],
        "flip": begun[:3000] + bytes([begun[3000] ^ 1]) + begun[3001:],
        "text": b"not a checkpoint\n",
        "empty": b"",
    }
    if damage in content:
        file.write_bytes(content[damage])
    else:
        kept = dict(np.load(io.BytesIO(begun)))
        np.savez(file, allow_pickle=False, **(kept | {"place": kept["place"][:-1]} if damage == "other size" else {}))
    said, before = [], bits(fresh)
    Checkpoint(file, "key", said.append).begin(fresh)
    assert len(said) == 1
    assert said[0].startswith("checkpoint.npz: damaged (")
    assert said[0].endswith("); the fluid run starts again at its first frame.")
    assert "\n" not in said[0]
    assert bits(fresh) == before


def test_a_checkpoint_has_the_names_that_versions_before_wrote(begun):
    """Those of version 7065196, whose checkpoints are read on, and five more; the solver has other names by now."""
    arrays = {"place", "velocity", "earlier_velocity", "density", "bulk", "fate", "quiet_s", "swelling"}
    arrays |= {"pressed", "free", "wall", "number", "released_in"}
    figures = {"density", "owner", "solves", "moving", "neighbours", "frames_s"}
    expected = {"key", "done", *arrays, *(f"seen_{name}" for name in figures)}
    assert set(np.load(io.BytesIO(begun)).files) == expected


def test_a_checkpoint_is_kept_by_the_clock_and_removed_when_the_run_is_done(fresh, tmp_path, monkeypatch):
    file = tmp_path / "checkpoint.npz"
    checkpoint = Checkpoint(file, "key", pytest.fail)
    checkpoint.begin(fresh)
    checkpoint.after_frame(fresh)
    assert not file.exists()
    monkeypatch.setattr("simulate.output.CHECKPOINT_EVERY_S", 0.0)
    checkpoint.after_frame(fresh)
    assert [path.name for path in tmp_path.iterdir()] == ["checkpoint.npz"]
    checkpoint.remove()
    assert not file.exists()


def test_a_checkpoint_has_behind_it_what_others_wrote_of_its_frame(tmp_path, monkeypatch):
    """Killed at any moment of frame 20. With the checkpoint before the row, on purpose, row 20 is lost."""
    monkeypatch.setattr("simulate.output.CHECKPOINT_EVERY_S", 0.0)
    for dies in ("before", "between", "after"):
        folder = tmp_path / dies
        folder.mkdir()
        kept, log = Checkpoint(folder / "run.npz", "", lambda _: None), HealthLog(folder / "health.csv")
        fates = {"before": (kept, log, Dies(20)), "between": (kept, Dies(20), log), "after": (Dies(20), kept, log)}
        with pytest.raises(KeyboardInterrupt):
            follow(injection(FREEZING, settle_s=0.1), Progress(), fates[dies])
        again = Checkpoint(folder / "run.npz", "", lambda _: None), HealthLog(folder / "health.csv")
        follow(injection(FREEZING, settle_s=0.1), Progress(), again)
        rows = (folder / "health.csv").read_text().splitlines()[1:]
        assert [int(row.split(",")[0]) for row in rows] == list(range(10, 10 * len(rows) + 1, 10))


class Dies:
    def __init__(self, frame: int) -> None:
        self._frame = frame

    def begin(self, injection: Injection) -> None: ...

    def after_frame(self, injection: Injection) -> None:
        if injection.done == self._frame:
            raise KeyboardInterrupt
