"""Pictures and films of a run as it goes: what is drawn lies where it should, in colours that mean the same."""

import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from matplotlib.patches import PathPatch
from PIL import Image, ImageSequence

from sealtwin.errors import InputError
from sealtwin.records import Frame, ParticleState
from tests.evidence import RADIUS_MM, axes_of, make_evidence
from validate.drawing.health_plot import PANELS, draw_health
from validate.drawing.particles import SPEED, Along
from validate.drawing.snapshots import Scene, draw_fill, draw_snapshot
from validate.film import Painter, write_film
from validate.gallery import write_gallery
from validate.reporting.plates import fill_plates


@pytest.fixture(scope="module")
def evidence(tmp_path_factory):
    return make_evidence(tmp_path_factory.mktemp("evidence"))


@pytest.fixture(scope="module")
def scene(evidence):
    return Scene(evidence.outline, evidence.solid, evidence.trajectory, RADIUS_MM, 2.4)


def frame_of(run, t_s: float) -> Frame:
    """A part of the fill that grows with time; the last particle has spilled, and one moves 50 times as fast."""
    count = round(len(run.age_s) * t_s / 10)
    velocity_mm_s = np.zeros((count, 3))
    velocity_mm_s[:, 2] = -10.0
    velocity_mm_s[0, 2] = -500.0
    state = np.full(count, int(ParticleState.MOVING))
    state[-1] = ParticleState.SPILLED
    return Frame(t_s, run.position_mm[:count], velocity_mm_s, np.linspace(t_s, 0, count), np.ones(count), state)


@pytest.fixture(scope="module")
def frames(evidence):
    return [frame_of(evidence.run, t_s) for t_s in (0.5, 7.0, 10.0)]


def test_places_along_a_crack_run_on_past_its_ends_and_left_is_above_zero(evidence):
    """The slot of this trial runs along x from the origin, so s is x, and left of it is y."""
    points_mm = np.array([[-7.0, 1.0], [0.0, 0.5], [13.0, -1.2], [47.0, 2.0]])
    s_mm, aside_mm = Along(evidence.outline).of(points_mm)
    assert s_mm == pytest.approx(points_mm[:, 0], abs=0.06)
    assert aside_mm == pytest.approx(points_mm[:, 1], abs=0.01)


def test_the_fill_shows_every_moment_by_speed_and_by_age_on_common_scales(scene, frames):
    figure = draw_fill(frames, scene)
    *panels, speeds, ages = axes_of(figure)
    assert (speeds.get_xlabel(), ages.get_xlabel()) == ("speed (mm/s)", "age (s)")
    for number, frame in enumerate(frames):
        by_speed, by_age = panels[2 * number : 2 * number + 2]
        assert by_speed.get_title(loc="left") == f"t = {frame.t_s:.2f} s"
        _, shown = scene.side(frame)
        assert len(shown) == len(frame.age_s) - 1  # all but the one that spilled
        for axes, value in ((by_speed, frame.speed_mm_s), (by_age, frame.age_s)):
            (discs,) = axes.collections
            assert np.asarray(discs.get_offsets()) == pytest.approx(frame.position_mm[shown][:, [0, 2]], abs=0.06)
            assert np.asarray(discs.get_array()) == pytest.approx(value[shown])
            assert axes.get_aspect() == 1.0
        # One scale for all moments, or they could not be compared.
        assert by_age.collections[0].get_clim() == (0.0, 10.0)
        assert by_speed.collections[0].norm is SPEED.norm


def test_what_is_nearest_to_the_centreline_lies_on_top(scene, frames):
    _, shown = scene.side(frames[-1])
    aside_mm = np.abs(frames[-1].position_mm[shown, 1])
    assert (np.diff(aside_mm) <= 1e-6).all()
    assert aside_mm[0] > aside_mm[-1]


def axes_box(axes, box):
    return axes.transAxes.inverted().transform_bbox(box).extents


def area(ring):
    x, y = np.asarray(ring).T
    return 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


def test_a_snapshot_has_a_unit_on_every_axis_and_hides_what_the_face_hides(scene, frames):
    frame = frames[-1]
    figure = draw_snapshot(frame, scene)
    by_age, by_speed, top, *sections, ages, speeds = axes_of(figure)
    assert "t = 10.00 s" in by_age.get_title(loc="left")
    for axes in (by_age, by_speed, top, *sections):
        assert axes.get_xlabel().endswith("(mm)")
        assert axes.get_aspect() == 1.0
    assert (ages.get_ylabel(), speeds.get_ylabel()) == ("age (s)", "speed (mm/s)")
    under, over = top.collections
    (mortar,) = [patch for patch in top.patches if isinstance(patch, PathPatch)]
    assert under.get_zorder() < mortar.get_zorder() < over.get_zorder()
    assert len(np.asarray(under.get_offsets())) + len(np.asarray(over.get_offsets())) == len(frame.age_s) - 1
    # Its second ring goes round the other way: a hole where the crack is.
    face, crack = mortar.get_path().to_polygons(closed_only=True)
    assert np.sign(area(face)) == -np.sign(area(crack))
    assert abs(area(crack)) == pytest.approx(40 * 3.1, rel=0.01)
    # Its clip is in the place of the axes', beside which nothing must be painted.
    clip = mortar.get_clip_box()
    assert clip is not None
    assert axes_box(top, clip) == pytest.approx(np.clip(axes_box(top, clip), 0, 1), abs=1e-6)


def test_the_nozzle_stands_where_it_is_then_and_is_gone_after_its_path(scene, evidence):
    path = evidence.trajectory
    assert scene.nozzle_mm(float(path.t_s[0])) == pytest.approx(path.position_mm[0])
    assert scene.nozzle_mm(float(path.t_s[-1]) + 1.0) is None


def test_many_moments_are_thinned_to_a_page(scene, frames):
    figure = draw_fill(frames * 7, scene)
    assert len(axes_of(figure)) == 8 * 2 + 2


def test_a_report_shows_the_fill_where_the_run_left_snapshots(evidence, frames):
    plates = {len(given): fill_plates(replace(evidence, frames=given)) for given in ((), tuple(frames))}
    (extra,) = [plate for plate in plates[3] if plate.caption not in {plate.caption for plate in plates[0]}]
    assert "as in the paper's Fig. 6" in extra.caption
    assert len(axes_of(extra.draw(None))) == 3 * 2 + 2


@pytest.fixture(scope="module")
def health():
    """Of a run in which nothing moved at the end."""
    columns = {name: np.linspace(0.0, 0.1, 6) for _, curves in PANELS for name in curves}
    columns["density_error_mean"] = np.array([0.0, 0.01, 0.02, 0.03, np.nan, np.nan])
    return columns | {"t_s": np.linspace(0.0, 1.0, 6), "escaped": np.zeros(6), "spilled": np.zeros(6)}


def test_health_shows_per_cent_and_the_zero_of_what_must_stay_zero(health):
    compression, _, lost, *_ = axes_of(draw_health(health))
    assert np.nanmax(np.asarray(compression.lines[0].get_ydata(), float)) == pytest.approx(3.0)
    assert compression.get_ylabel() == "compression (%)"
    assert lost.get_ylim() == (0.0, 1.0)


def test_a_gallery_is_the_same_when_it_is_made_again(scene, frames, health, tmp_path, monkeypatch):
    """But for the last bits of where the layout puts a panel; no file says when it was made, or by what."""
    monkeypatch.setattr("validate.gallery.DPI", 40)
    for run in ("a", "b"):
        names = write_gallery(tmp_path / run, {"0007.000s": frames[1]}, scene, health)
        assert names == [
            "health.png", "health.svg", "snapshots/0007.000s.png", "snapshots/0007.000s.svg", "snapshots/fill.png",
            "snapshots/fill.svg",
        ]  # fmt: skip
    for stem in ("health", "snapshots/0007.000s", "snapshots/fill"):
        first, again = (pixels(tmp_path / run / f"{stem}.png") for run in ("a", "b"))
        assert np.abs(first - again).mean() < 0.1
        for kind in ("png", "svg"):
            assert not re.search(rb"dc:date|Software|matplotlib\.org", (tmp_path / "a" / f"{stem}.{kind}").read_bytes())


def pixels(path):
    with Image.open(path) as opened:
        return np.asarray(opened.convert("RGB"), dtype=int)


def film(path, scene, frames):
    said = []
    write_film(path, [frame.t_s for frame in frames], lambda number: frames[number], scene, said.append)
    assert said == list(range(1, len(frames) + 1))


def test_a_gif_shows_each_frame_for_as_long_as_it_lasts(scene, frames, tmp_path):
    """In the run's own time, where players can show that: 6.5 s between two frames are shown as one."""
    timed = [replace(frame, t_s=t_s) for frame, t_s in zip(frames, (0.5, 0.6, 7.1), strict=True)]
    film(tmp_path / "fill.gif", scene, timed)
    with Image.open(tmp_path / "fill.gif") as opened:
        shown = [
            (picture.info["duration"], np.asarray(picture.convert("RGB"), dtype=int))
            for picture in ImageSequence.Iterator(opened)
        ]
    assert [duration for duration, _ in shown] == [100, 1000, 1500]
    painted = Painter(scene).paint(timed[1]).astype(int)
    # 128 colours for all: neighbours on the scales become one.
    assert np.abs(shown[1][1] - painted).mean() < 2.0
    assert np.abs(shown[1][1] - shown[0][1]).mean() > 4.0


def test_an_mp4_can_be_read_back(scene, frames, tmp_path):
    timed = [replace(frames[k // 2], t_s=k / 10) for k in range(6)]
    film(tmp_path / "fill.mp4", scene, timed)
    read = cv2.VideoCapture(str(tmp_path / "fill.mp4"))
    assert read.get(cv2.CAP_PROP_FRAME_COUNT) == 6
    assert read.get(cv2.CAP_PROP_FPS) == pytest.approx(10, rel=1e-3)
    painter = Painter(scene)
    for frame in timed:
        found, picture = read.read()
        assert found
        painted = painter.paint(frame).astype(int)
        coloured = np.ptp(painted, axis=2) > 60
        # Of 255, where something is coloured: red for blue would be 80 off.
        assert np.abs(picture[:, :, ::-1].astype(int) - painted)[coloured].mean() < 30.0


def test_a_film_that_cannot_be_made_is_one_sentence_and_no_file(scene, frames, tmp_path, monkeypatch):
    for name, shown, said in (("fill.avi", frames, r"\.gif or \.mp4"), ("fill.gif", frames[:1], "needs two frames")):
        with pytest.raises(InputError, match=said):
            write_film(tmp_path / name, [f.t_s for f in shown], lambda number: frames[number], scene, lambda _: None)
    monkeypatch.setattr(cv2.VideoWriter, "isOpened", lambda _: False, raising=False)
    with pytest.raises(InputError, match=r"no encoder for MP4.* \.gif"):
        film(tmp_path / "fill.mp4", scene, frames)
    assert not list(tmp_path.iterdir())
