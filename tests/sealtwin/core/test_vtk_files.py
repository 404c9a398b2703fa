"""Frames for ParaView, read by an independent reader of the format and by our own."""

import numpy as np
import pytest

from sealtwin.core.errors import InputError
from sealtwin.core.vtk_files import Frame, read_collection, read_frame, write_collection, write_frame
from tests.support.vtk_reader import read_polydata, read_pvd


def a_frame(count: int = 37, t_s: float = 0.1 + 0.2) -> Frame:
    chance = np.random.default_rng(3)
    return Frame(
        t_s=t_s,
        position_mm=chance.normal(size=(count, 3)) * 30,
        velocity_mm_s=chance.normal(size=(count, 3)) * 70,
        age_s=chance.uniform(0, 3, count),
        density=chance.uniform(0.9, 1.1, count),
        state=chance.integers(0, 4, count),
    )


@pytest.mark.parametrize("count", [37, 0])
def test_a_written_frame_is_read_unchanged_by_two_readers(tmp_path, count):
    """Values agree within the rounding of float32, and the time is exact."""
    frame = a_frame(count)
    write_frame(tmp_path / "frame.vtp", frame)
    data = read_polydata(tmp_path / "frame.vtp")
    assert np.array_equal(data.points, frame.position_mm.astype(np.float32))
    wanted = {name: getattr(frame, name) for name in ("velocity_mm_s", "speed_mm_s", "age_s", "density", "state")}
    assert set(data.point_data) == set(wanted)
    for name, values in wanted.items():
        assert np.array_equal(data.point_data[name], values.astype(data.point_data[name].dtype)), name
    assert data.vertices == [[i] for i in range(count)]
    assert data.field_data["TimeValue"].tolist() == [frame.t_s]
    assert data.active == {"Scalars": "speed_mm_s", "Vectors": "velocity_mm_s"}
    read = read_frame(tmp_path / "frame.vtp")
    assert read.t_s == frame.t_s
    assert np.array_equal(read.state, frame.state)
    for name in ("position_mm", "velocity_mm_s", "age_s", "density"):
        assert getattr(read, name) == pytest.approx(getattr(frame, name), rel=1e-6), name


def test_a_frame_collection_lists_the_times_and_files_of_frames(tmp_path):
    frames = [(0.1 + 0.2, "frame_00001.vtp"), (1.0, "frame_00002.vtp")]
    write_collection(tmp_path / "fill.pvd", frames)
    wanted = [(t_s, tmp_path / name) for t_s, name in frames]
    assert read_pvd(tmp_path / "fill.pvd") == wanted
    assert read_collection(tmp_path / "fill.pvd") == wanted


@pytest.mark.parametrize("damage", ["cut", "other", "missing"])
def test_a_damaged_frame_is_refused_with_a_remedy(tmp_path, damage):
    path = tmp_path / "frame.vtp"
    write_frame(path, a_frame())
    whole = path.read_bytes()
    path.write_bytes({"cut": whole[:-900], "other": whole.replace(b"age_s", b"haste")}.get(damage, b""))
    if damage == "missing":
        path.unlink()
    with pytest.raises(InputError, match=r"frame\.vtp: (is damaged.* Delete the folder .*, and checkpoint|not found)"):
        read_frame(path)


@pytest.mark.parametrize("content", ["<VTKFile", '<VTKFile><DataSet file="a.vtp"/></VTKFile>', "<VTKFile/>"])
def test_the_error_for_a_damaged_frame_collection_names_the_files_to_delete(tmp_path, content):
    """A run reads the collection before rewriting it, so that 'simulate again' alone would never work."""
    path = tmp_path / "fill.pvd"
    path.write_text(content)
    with pytest.raises(InputError, match=r"fill\.pvd: is damaged.* Delete it, and checkpoint\.npz if") as fault:
        read_collection(path)
    assert fault.value.exit_code == 3
    assert len(str(fault.value).splitlines()) == 1


@pytest.mark.parametrize("name", ["../away.vtp", "/etc/passwd"])
def test_a_frame_collection_with_files_outside_its_folder_is_refused(tmp_path, name):
    write_collection(tmp_path / "fill.pvd", [(0.0, name)])
    with pytest.raises(InputError, match="not a collection"):
        read_collection(tmp_path / "fill.pvd")
