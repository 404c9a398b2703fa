"""Stiff paste that collapses under the nozzle is computed again with finer substeps, and the run records this."""

import io
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sealtwin.core.errors import NumericalError
from sealtwin.core.progress import Progress
from sealtwin.core.records import Run
from simulate.injection import ComputeOptions, Injection, Watcher
from simulate.pour import Pour
from simulate.run import fill, fill_each
from simulate.settings import Fluid, SampleSlope, Solver
from simulate.watchers import Checkpoint, FrameFiles, KeptFill, Moments
from tests.support.messages import Narration
from tests.support.small_fluids import path, pour, sample_of, sealant, slot

STIFF = sealant(viscosity_pa_s=4.2, yield_stress_pa=12.0, density_kg_m3=1690.0)
THIN = STIFF.model_copy(update={"viscosity_pa_s": 2.0})
CRACK = slot(8.0, width_mm=3.9, depth_mm=6.0)
WAY = path(CRACK[1], 0.25, speed_mm_s=7.5)
SAMPLE = sample_of(CRACK, WAY)
SOLVER = Solver(radius_mm=0.378, settle_s=0.0)


class Dies(Watcher):
    """Kills a run of twice the substeps after some frames."""

    def __init__(self, frame: int) -> None:
        self._frame = frame

    def after_frame(self, injection: Injection) -> None:
        if injection.finer == 2 and injection.done == self._frame:
            raise KeyboardInterrupt


class Begun(Watcher):
    def __init__(self) -> None:
        self.at: list[tuple[int, int]] = []

    def begin(self, injection: Injection) -> None:
        self.at.append((injection.finer, injection.done))


def filled(fluid: Fluid = STIFF, solver: Solver = SOLVER, progress: Progress | None = None, *watchers: Watcher) -> Run:
    options = ComputeOptions(progress=progress or Progress(), watchers=watchers)
    return fill(Pour(SAMPLE, (fluid,), solver), options)[0]


@cache
def four_substeps() -> Run:
    return pour(CRACK, WAY, STIFF, radius_mm=0.378, substeps=4)


def test_a_collapsed_run_is_repeated_with_twice_the_substeps(tmp_path):
    heard, begun = Narration(), Begun()
    moments = list[float]()
    taken = Moments([0.1 * number for number in range(1, 99)], lambda t_s, frame: moments.append(frame.t_s))
    frames_of = FrameFiles(tmp_path / "frames" / "fill.pvd", (0.1, 0.2, 0.5))
    run = filled(STIFF, SOLVER, heard, begun, taken, frames_of)
    assert begun.at == [(1, 0), (2, 0)]
    assert np.array_equal(run.position_mm, four_substeps().position_mm)
    assert run.settings["solver"]["substeps"] == 4
    assert (run.health.substeps, run.health.finer) == (4, 2)
    assert "finer" not in four_substeps().health.recorded(), "a given number of substeps is no second attempt"
    assert run.remarks[-1].key == "fluid.computed-anew"
    assert heard.notes == [f"note: {remark}" for remark in run.remarks], "each once"
    second = moments[next(k for k in range(1, len(moments)) if moments[k] < moments[k - 1]) :]
    assert len(second) == 5, "every moment of the second run is taken, from the first on"
    assert len(list((tmp_path / "frames").glob("*.vtp"))) == 3


@pytest.mark.parametrize(("named", "tries"), [(True, [2, 4, 8, 16]), (False, [2])])
def test_a_run_that_collapses_with_eight_times_the_substeps_fails(monkeypatch, named, tries):
    """An error without a failed run, such as one of the host, is not a collapse."""
    substeps = []

    def collapses(self: Injection) -> None:
        substeps.append(self.engine.substeps)
        fault = NumericalError("collapsed")
        if named:
            self.failed[0] = fault
        raise fault

    monkeypatch.setattr(Injection, "advance", collapses)
    with pytest.raises(NumericalError, match="collapsed"):
        fill_each(Pour(SAMPLE, (THIN,), SOLVER), ComputeOptions()) if not named else filled()
    assert substeps == tries


def test_only_the_collapsed_run_of_a_launch_is_repeated():
    """The seed and the slope are unchanged. Frames of the first run, which is watched, are taken again."""
    kept = KeptFill((0.1, 0.2))
    inputs = Pour(SAMPLE, (STIFF, THIN), SOLVER, seed=3, slope=SampleSlope(gradient_deg=13.0))
    runs = fill_each(inputs, ComputeOptions(watchers=[kept]))
    for run, single, substeps in zip(runs, inputs.each, (4, 2), strict=True):
        assert not isinstance(run, NumericalError)
        assert run[0].settings["solver"]["substeps"] == substeps
        alone = fill(single)[0]
        assert np.array_equal(run[0].position_mm, alone.position_mm)
        assert run[0].doubts == alone.doubts != ()
    with np.load(io.BytesIO(kept.content())) as arrays:
        assert len(arrays["t_s"]) == 3, "two moments and the end of the second run"


@pytest.mark.parametrize("finer", [2, 3, [2, 2]])
def test_an_invalid_checkpoint_or_the_checkpoint_of_another_run_is_ignored(tmp_path, finer):
    """The run starts with its own substeps, and one sentence reports the checkpoint."""
    file, sentences, begun = tmp_path / "checkpoint.npz", list[str](), Begun()
    key = "another" if finer == 2 else "key"
    np.savez(file, allow_pickle=False, key=np.array(key), finer=np.array(finer))
    filled(THIN, SOLVER, None, Checkpoint(file, "key", sentences.append), begun)
    assert begun.at == [(1, 0)]
    assert len(sentences) == 1


@pytest.mark.parametrize("keeps", [True, False])
def test_a_killed_run_with_finer_substeps_continues_at_its_last_checkpoint(tmp_path: Path, keeps, monkeypatch):
    """If no checkpoint was due yet, the run with finer substeps starts at its first frame.

    A kill within frame 90 leaves frame 89. The collapsed attempt is not continued in either case.
    """
    monkeypatch.setattr("simulate.watchers.EVERY_S", 0.0 if keeps else 1e9)
    sentences, begun = list[str](), Begun()
    first, second = (Checkpoint(tmp_path / "checkpoint.npz", "key", sentences.append) for _ in range(2))
    with pytest.raises(KeyboardInterrupt):
        filled(STIFF, SOLVER, None, first, Dies(90))
    assert sentences == []
    run = filled(STIFF, SOLVER, None, second, begun)
    assert begun.at == [(2, 89 if keeps else 0)]
    assert len(sentences) == 1
    assert np.array_equal(run.position_mm, four_substeps().position_mm)
