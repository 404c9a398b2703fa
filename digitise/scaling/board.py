"""A frame of markers to print, cut out and lay level with a sample's face; and its table for the trial file."""

from dataclasses import dataclass

import numpy as np

from digitise.scaling.markers import black_modules
from digitise.scaling.sheet import Bar, Sheet, Words
from digitise.settings import Marker, MarkerBoard
from sealtwin.errors import InputError
from sealtwin.records import Floats

PAPERS_MM = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
UNPRINTED_MM = 6.0
"""What printers leave blank along the edge of the paper."""
WHITE = 0.375
"""Of a marker's side, around each: its detection needs one module, a sixth; the rest is for a hand with a knife."""
CUT_GREY, CUT_MM = 0.75, 0.1
"""The line to cut along. What the knife leaves of it must not look like the edge of the face."""
RULER_MM, RULER_THICK_MM = 100.0, 0.3
LEAST_FACE_MM, MOST_FACE_MM = 5.0, 400.0
"""Of a frame's opening: a smaller one hides behind its own markers; a larger one is no paper."""
LINE_MM = 4.5
"""Between lines of text."""
CAPTION_MM = 12.0 + 5 * LINE_MM
"""Below the frame: the ruler, and five lines."""
CAPTION_WIDTH_MM = 165.0


@dataclass(frozen=True)
class Frame:
    """What is printed, and what the trial file then says."""

    sheet: Sheet
    board: MarkerBoard
    face_mm: tuple[float, float]


def draw_frame(face_mm: tuple[float, float], board: MarkerBoard, paper: str) -> Frame:
    """The sheet of paper, upright or on its side, with the frame in its middle.

    ``paper`` is one of ``PAPERS_MM``. Raises InputError where the frame does not fit on it.
    """
    white_mm = WHITE * board.size_mm
    band_mm = board.size_mm + 2 * white_mm
    frame_mm = (face_mm[0] + 2 * band_mm, face_mm[1] + 2 * band_mm)
    needed_mm = (max(frame_mm[0], CAPTION_WIDTH_MM), frame_mm[1] + CAPTION_MM)
    short_mm, long_mm = PAPERS_MM[paper]
    for width_mm, height_mm in ((short_mm, long_mm), (long_mm, short_mm)):
        if needed_mm[0] <= width_mm - 2 * UNPRINTED_MM and needed_mm[1] <= height_mm - 2 * UNPRINTED_MM:
            break
    else:
        raise InputError(
            f"the frame is {frame_mm[0]:.0f} x {frame_mm[1]:.0f} mm, with its ruler and text {needed_mm[0]:.0f} x "
            f"{needed_mm[1]:.0f}; {paper} takes {short_mm - 2 * UNPRINTED_MM:.0f} x {long_mm - 2 * UNPRINTED_MM:.0f}, "
            "either way up. Give a larger --paper or a smaller --size-mm."
        )
    origin_mm = np.array([(width_mm - face_mm[0]) / 2, height_mm - UNPRINTED_MM - band_mm - face_mm[1]])
    bars = [
        *_cut_line(face_mm, origin_mm),
        *(bar for marker in board.markers for bar in _marker(board, marker, origin_mm)),
    ]
    left_mm, top_mm = (width_mm - CAPTION_WIDTH_MM) / 2, origin_mm[1] - band_mm
    bars += _ruler(left_mm, top_mm - 8)
    words = [
        Words(left_mm + RULER_MM + 4, top_mm - 8, "This ruler must be 100.0 mm long."),
        *(Words(left_mm, top_mm - 12 - LINE_MM * (row + 1), text) for row, text in enumerate(_caption(board, face_mm))),
    ]
    return Frame(Sheet(width_mm, height_mm, tuple(bars), tuple(words)), board, face_mm)


def checked_face(face_mm: tuple[float, float]) -> tuple[float, float]:
    """Raises InputError where no sample has such a face."""
    if not all(LEAST_FACE_MM <= side <= MOST_FACE_MM for side in face_mm):
        raise InputError(
            f"a face of {face_mm[0]:g} x {face_mm[1]:g} mm: sides of {LEAST_FACE_MM:g} to {MOST_FACE_MM:g} mm can be; "
            "give width x height of the cracked face, as in 160x40."
        )
    return face_mm


def board_around(face_mm: tuple[float, float], size_mm: float, dictionary: str, count: int) -> MarkerBoard:
    """Four markers at the corners of the face, and with ``count`` 8 also in the middle of its sides.

    Raises InputError where they would touch.
    """
    width, height = face_mm
    off = size_mm * (0.5 + WHITE)
    columns, rows = ((-off, side / 2, side + off) for side in (width, height))
    if count == 4:
        columns, rows = (columns[0], columns[2]), (rows[0], rows[2])
    apart_mm, needed_mm = min(columns[1] - columns[0], rows[1] - rows[0]), size_mm * (1 + WHITE)
    if apart_mm < needed_mm:
        raise InputError(
            f"{count} markers of {size_mm:g} mm around a face of {width:g} x {height:g} mm would be {apart_mm:.1f} mm "
            f"apart; with white between they need {needed_mm:.1f}. Give smaller markers, or 4 of them."
        )
    places = [(x, y) for y in rows for x in columns if (x, y) != (width / 2, height / 2)]
    markers = tuple(Marker(id=number, x_mm=x, y_mm=y) for number, (x, y) in enumerate(places))
    return MarkerBoard.model_validate({"dictionary": dictionary, "size_mm": size_mm, "markers": markers})


def board_toml(frame: Frame) -> str:
    """The table to paste into a trial file, and the size of the face, which belongs into the table above it."""
    width_mm, height_mm = frame.face_mm
    rows = [f"  {{ id = {it.id}, x_mm = {it.x_mm}, y_mm = {it.y_mm} }}," for it in frame.board.markers]
    return "\n".join(
        [
            f"# In [photo]: face_mm = [{width_mm}, {height_mm}]",
            "[photo.markers]",
            f'dictionary = "{frame.board.dictionary}"',
            f"size_mm = {frame.board.size_mm}",
            "markers = [",
            *rows,
            "]",
            "",
        ]
    )


def _caption(board: MarkerBoard, face_mm: tuple[float, float]) -> list[str]:
    return [
        f"sealtwin markers: {len(board.markers)} of {board.dictionary}, {board.size_mm:g} mm, around a face of "
        f"{face_mm[0]:g} x {face_mm[1]:g} mm",
        'Print at 100 % ("actual size", not "fit to page"), on matt paper or card, and glue it flat.',
        "Measure the ruler. Where it is not 100.0 mm, multiply every mm of [photo.markers] by its length / 100.",
        "Cut out the opening, and lay the frame level with the cracked face, this text upright in the photo.",
        "Each mm above or below the face is 1 mm / distance to the camera of every length: 0.33 % at 300 mm.",
    ]


def _marker(board: MarkerBoard, marker: Marker, origin_mm: Floats) -> list[Bar]:
    """A black square, and the white cells in it."""
    square, cells = black_modules(board, marker)
    return [_bar(square + origin_mm, 0.0), *(_bar(cell + origin_mm, 1.0) for cell in cells)]


def _bar(ring_mm: Floats, grey: float) -> Bar:
    (left, low), (right, high) = ring_mm.min(axis=0), ring_mm.max(axis=0)
    return Bar(float(left), float(low), float(right - left), float(high - low), grey)


def _cut_line(face_mm: tuple[float, float], origin_mm: Floats) -> list[Bar]:
    """Just inside the opening, so that it is cut away with it."""
    (left, low), (width, height) = (float(value) for value in origin_mm), face_mm
    return [
        Bar(left, low, width, CUT_MM, CUT_GREY),
        Bar(left, low + height - CUT_MM, width, CUT_MM, CUT_GREY),
        Bar(left, low, CUT_MM, height, CUT_GREY),
        Bar(left + width - CUT_MM, low, CUT_MM, height, CUT_GREY),
    ]


def _ruler(left_mm: float, low_mm: float) -> list[Bar]:
    """100 mm from the outer edge of its first mark to that of its last, with a mark every 10 mm between."""
    marks = [
        Bar(left_mm + 10 * i - RULER_THICK_MM / 2, low_mm, RULER_THICK_MM, 3.0 if i % 5 else 4.5) for i in range(1, 10)
    ]
    ends = [Bar(left_mm + x, low_mm, RULER_THICK_MM, 4.5) for x in (0.0, RULER_MM - RULER_THICK_MM)]
    return [Bar(left_mm, low_mm, RULER_MM, RULER_THICK_MM), *ends, *marks]
