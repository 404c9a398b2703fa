"""Files of a run folder during its run, complete at any moment and after a kill."""

import shutil
from pathlib import Path

import pytest

from sealtwin.core.errors import InputError
from sealtwin.core.run_folder import MANIFEST
from simulate.injection import Injection
from simulate.settings import Fluid
from simulate.watchers import FrameFiles, StillThere
from tests.support.small_fluids import injected, path, slot
from tests.support.vtk_reader import read_polydata, read_pvd


def injection() -> Injection:
    crack, fluid = slot(12.0), Fluid(U=30.0, D_cm=0.3, freeze_after_s=0.2)
    return injected(crack, path(crack[1], 0.12, 20.0), fluid, seed=1, radius_mm=0.6, settle_s=0.1)


def go_on(run: Injection, watcher: FrameFiles, frames: int) -> None:
    for _ in range(frames):
        run.advance()
        watcher.after_frame(run)


def listed(folder: Path) -> list[tuple[float, str]]:
    """Return the entries of the collection, whose times are compared with those of the files."""
    entries = read_pvd(folder / "fill.pvd")
    for t_s, file in entries:
        assert read_polydata(file).field_data["TimeValue"].tolist() == [t_s]
    return [(t_s, file.name) for t_s, file in entries]


def test_the_frame_collection_is_complete_after_every_frame_and_a_kill(tmp_path):
    """Frames up to the checkpoint are kept; later frames and temporary files are removed."""
    folder, times_s = tmp_path / "frames", [0.05 * number for number in range(12)]
    run, watcher, lengths, checkpoint = injection(), FrameFiles(folder / "fill.pvd", times_s), [], {}
    watcher.begin(run)
    for _ in range(50):
        go_on(run, watcher, 1)
        lengths.append(len(listed(folder)))
        if run.done == 25:
            checkpoint = run.snapshot()
    assert lengths == sorted(lengths)
    assert lengths[24] < lengths[-1] == len(list(folder.glob("*.vtp")))
    before_kill = listed(folder)
    (folder / ".sealtwin-tmp-4711-0123abcd.vtp").write_bytes(b"half")
    mine = {".notes.txt", "axes.vtp", "results.vtp"}
    for name in mine:
        (folder / name).write_text("mine")
    resumed, watcher = injection(), FrameFiles(folder / "fill.pvd", times_s)
    resumed.restore(checkpoint)
    watcher.begin(resumed)
    assert listed(folder) == before_kill[: lengths[24]]
    assert {file.name for file in folder.iterdir()} == {"fill.pvd", *mine, *(name for _, name in listed(folder))}
    go_on(resumed, watcher, 25)
    assert listed(folder) == before_kill


def test_a_run_folder_removed_during_its_run_is_not_created_again(tmp_path):
    folder, run = tmp_path / "run", injection()
    folder.mkdir()
    (folder / MANIFEST).write_text("{}")
    still_there = StillThere(folder)
    with pytest.raises(InputError, match="was removed during the fluid run"):  # noqa: PT012
        still_there.begin(run)
        run.advance()
        still_there.after_frame(run)
        shutil.rmtree(folder)
        run.advance()
        still_there.after_frame(run)
    assert not folder.exists()
