"""Pictures of the fill during a run: positions, colours and layouts."""

import numpy as np
import pytest
from matplotlib.layout_engine import ConstrainedLayoutEngine

from tests.support.evidence import axes_of
from validate.figures.particles import SPEED
from validate.figures.snapshots import Snapshot, draw_fill, draw_sections, write_gallery
from validate.figures.theme import as_picture, wide_figure


def test_frames_of_the_fill_are_coloured_on_a_common_scale(scene, frames):
    """Speed has a fixed scale, and age the scale of all frames, so that frames can be compared."""
    by_speed = draw_fill(frames, scene)
    draw_sections(by_age := wide_figure(2.0), [[(scene, frame) for frame in frames]], "age")
    assert axes_of(by_speed)[0].get_title(loc="left") == "t = 0.50 s"
    for figure, label, limits in ((by_speed, "speed (mm/s)", SPEED.norm), (by_age, "age (s)", (0.0, 10.0))):
        *panels, bar = axes_of(figure)
        assert bar.get_xlabel() == label
        for axes, frame in zip(panels, frames, strict=True):
            shown = np.argsort(-np.abs(frame.position_mm[:-1, 1]), kind="stable")  # all but the one that spilled
            value = frame.speed_mm_s if figure is by_speed else frame.age_s
            _, discs = axes.collections
            assert np.asarray(discs.get_offsets()) == pytest.approx(frame.position_mm[shown][:, [0, 2]], abs=0.06)
            assert np.asarray(discs.get_array()) == pytest.approx(value[shown])
            assert axes.get_aspect() == 1.0
            assert limits in (discs.norm, discs.get_clim())


def test_at_most_eight_frames_are_drawn_and_the_nozzle_only_while_it_is_on_its_path(scene, evidence, frames):
    path = evidence.trajectory
    assert scene.nozzle_mm(float(path.t_s[0])) == pytest.approx(path.position_mm[0])
    assert scene.nozzle_mm(float(path.t_s[-1]) + 1.0) is None
    assert len(axes_of(draw_fill(frames * 7, scene))) == 8 + 1


def test_all_snapshots_of_a_run_share_one_layout(scene, frames, tmp_path, monkeypatch):
    laid_out = list[str]()

    def written(_, name, figure):
        if isinstance(engine := figure.get_layout_engine(), ConstrainedLayoutEngine):
            laid_out.append(name)
            engine.execute(figure)
        return [name]

    monkeypatch.setattr("validate.figures.snapshots._write", written)
    named = {f"{frame.t_s:08.3f}s": frame for frame in frames}
    last, *others = (f"snapshots/{name}" for name in reversed(named))
    assert write_gallery(tmp_path, named, scene) == [last, *others]
    assert laid_out == [last]


def test_a_snapshot_shows_nothing_of_the_previous_snapshot(scene, frames):
    snapshot = Snapshot(scene)
    snapshot.draw(frames[-1])
    once, after = Snapshot(scene).draw(frames[0]), snapshot.draw(frames[0])
    for figure in (once, after):
        figure.set_layout_engine("none")
    assert as_picture(once).tobytes() == as_picture(after).tobytes()
