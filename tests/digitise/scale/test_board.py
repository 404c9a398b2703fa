import io
import json
import tomllib
from pathlib import Path

import numpy as np
import pypdf
import pytest

from digitise.photo import load_photo, read_pixels
from digitise.scale.marker_scale import CUT_GREY, CUT_MM, board_around, board_toml, corners_mm, find_markers, frame_pdf
from digitise.settings import Dictionary, MarkerBoard, PhotoInput
from sealtwin.core.errors import InputError
from tests.support.photos import write_png
from tests.support.sheets import Page, read_pdf

FACE_MM = (160.0, 40.0)
PX_PER_MM = 6.0


def frame_of(face_mm=FACE_MM, size_mm=16.0, dictionary: Dictionary = "4x4_50", count=8, paper="a4") -> bytes:
    return frame_pdf(face_mm, board_around(face_mm, size_mm, dictionary, count), paper)


def printed(folder: Path, **changes) -> Page:
    (folder / "frame.pdf").write_bytes(frame_of(**changes))
    return read_pdf(folder / "frame.pdf")


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Page:
    """The default frame."""
    return printed(tmp_path_factory.mktemp("page"))


def test_a_photo_of_the_printed_page_is_measured_by_the_table_that_comes_with_it(tmp_path):
    """Rastered at 6 px/mm: each marker to 10 µm, and the scale of the whole to 0.01 %."""
    changes = {"count": 4, "dictionary": "apriltag_36h11", "size_mm": 20.0, "face_mm": (70.0, 40.0)}
    light = printed(tmp_path, **changes).light(PX_PER_MM)
    arguments = [changes[name] for name in ("face_mm", "size_mm", "dictionary", "count")]
    table = tomllib.loads(board_toml(changes["face_mm"], board_around(*arguments)))["photo"]["markers"]
    board = MarkerBoard.model_validate_json(json.dumps(table))
    photo = load_photo(
        PhotoInput(file=write_png(tmp_path / "scan.png", light), data="synthetic", markers=board), tmp_path
    )
    assert photo.mm_per_px == pytest.approx(1 / PX_PER_MM, rel=1e-4)
    assert photo.scale_residual_mm is not None
    assert photo.scale_residual_mm < 0.01


def test_the_opening_lies_between_the_markers_as_the_table_says(page, tmp_path):
    """Its lower left corner is the origin of the table, and its line lies within it, to be cut away."""
    board = board_around(FACE_MM, 16.0, "4x4_50", 8)
    ((*cut_mm, _),) = [bar for bar in page.bars if bar[4] == pytest.approx(CUT_GREY / 255, abs=1e-3)]
    low_mm = np.array(cut_mm[:2]) - CUT_MM / 2
    assert np.array(cut_mm[2:]) + CUT_MM == pytest.approx(FACE_MM, abs=5e-3)
    file = write_png(tmp_path / "scan.png", page.light(PX_PER_MM))
    scan = read_pixels(PhotoInput(file=file, data="synthetic", mm_per_px=1), tmp_path)
    corners_px = find_markers(scan, "4x4_50", set(range(8)))
    for marker in board.markers:
        place_mm = (corners_px[marker.id] + 0.5) / PX_PER_MM
        place_mm[:, 1] = page.size_mm[1] - place_mm[:, 1]
        assert place_mm - low_mm == pytest.approx(corners_mm(board, marker), abs=0.01)


def test_the_ruler_is_100_mm_from_outer_edge_to_outer_edge(page):
    (line,) = [bar for bar in page.bars if bar[2] == pytest.approx(100, abs=5e-3) and bar[3] < 1]
    marks = [
        bar
        for bar in page.bars
        if bar[2] == pytest.approx(line[3], abs=5e-3) and bar[1] == pytest.approx(line[1], abs=5e-3)
    ]
    assert len(marks) == 11
    assert min(bar[0] for bar in marks) == pytest.approx(line[0], abs=5e-3)
    assert max(bar[0] + bar[2] for bar in marks) == pytest.approx(line[0] + 100, abs=5e-3)
    inner = sorted(bar[0] + bar[2] / 2 for bar in marks)[1:-1]
    assert np.diff(inner) == pytest.approx(10, abs=5e-3)


def test_a_viewer_is_asked_to_print_unscaled_and_the_same_page_is_the_same_file():
    """A frame printed again is recognised as the file that exists: no date, no random names."""
    reader = pypdf.PdfReader(io.BytesIO(frame_of()), strict=True)
    assert reader.viewer_preferences is not None
    assert reader.viewer_preferences.print_scaling == "/None"
    assert frame_of() == frame_of()


@pytest.mark.parametrize(
    ("changes", "refused"),
    [
        ({"face_mm": (300.0, 200.0)}, r"368 x 302 mm .* a4 has 210 x 297 mm, .* --paper"),
        ({"face_mm": (400.0, 300.0), "paper": "a3"}, r"468 x 402 mm .* a3 has 297 x 420 mm"),
        (
            {"face_mm": (40.0, 15.0), "size_mm": 20.0},
            r"8 markers of 20 mm .* would be 25\.0 mm apart; .* 27\.5 mm",
        ),
        ({"face_mm": (20.0, 10.0), "size_mm": 20.0}, r"would be 22\.5 mm apart; .* 27\.5 mm"),
    ],
)
def test_a_frame_that_cannot_be_printed_is_refused_with_the_sizes(changes, refused):
    with pytest.raises(InputError, match=refused):
        frame_of(**changes)
