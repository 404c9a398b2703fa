"""Draw a frame of markers to print, cut out and lay level with a sample's face, and its table for the trial file."""

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np

from digitise.scale.marker_scale import RULER_MM, black_modules
from digitise.settings import Dictionary, Marker, MarkerBoard
from sealtwin.core.errors import InputError

PAPERS_MM = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
UNPRINTED_MM = 6.0  # Unprintable margin along the edge of the paper
WHITE = 0.375  # White margin around a marker over its side: detection needs a sixth, the rest is for cutting by hand
CUT_GREY, CUT_MM = 0.75, 0.1  # Line to cut along, too light to be found as the edge of the face
RULER_THICK_MM = 0.3
LEAST_FACE_MM, MOST_FACE_MM = 5.0, 400.0  # Smallest and largest side of a frame's opening
LINE_MM = 4.5  # Distance between lines of text
CAPTION_MM = 12.0 + 5 * LINE_MM  # Height of the ruler and five lines of text below the frame
CAPTION_WIDTH_MM = 165.0
TEXT_PT = 8.5  # Height of the font
DRAWN_ON = datetime(2026, 1, 1, tzinfo=UTC)  # Date in the file: a frame drawn again is the same file

INSTRUCTIONS = (
    'Print at 100 % ("actual size", not "fit to page"), on matt paper or card, and glue it flat.',
    "Measure the ruler, and add printed_ruler_mm = (its length) to [photo.markers].",
    "Cut out the opening, and lay the frame level with the cracked face, with this text upright in the photo.",
    "Each mm above or below the face changes every length by 1 mm / distance to the camera: 0.33 % at 300 mm.",
)


class Bar(NamedTuple):
    """An upright, filled rectangle on the paper."""

    x_mm: float  # Lower left corner, from the paper's
    y_mm: float
    width_mm: float
    height_mm: float
    grey: float = 0.0  # 0 is black, 1 white


@dataclass(frozen=True)
class MarkerFrame:
    """A page to print, and the table for the trial file."""

    size_mm: tuple[float, float]  # Width and height of the paper
    bars: tuple[Bar, ...]  # In the order in which they are drawn
    lines: tuple[tuple[float, float, str], ...]  # Start of the baseline, x and y in mm from the same corner, and text
    board: MarkerBoard
    face_mm: tuple[float, float]


def draw_frame(face_mm: tuple[float, float], board: MarkerBoard, paper: str) -> MarkerFrame:
    """Lay the frame out on a paper of ``PAPERS_MM``, either way up; raise InputError if it does not fit."""
    band_mm = board.size_mm * (1 + 2 * WHITE)
    frame_mm = (face_mm[0] + 2 * band_mm, face_mm[1] + 2 * band_mm)
    needed_mm = (max(frame_mm[0], CAPTION_WIDTH_MM), frame_mm[1] + CAPTION_MM)
    short_mm, long_mm = PAPERS_MM[paper]
    for width_mm, height_mm in ((short_mm, long_mm), (long_mm, short_mm)):
        if needed_mm[0] <= width_mm - 2 * UNPRINTED_MM and needed_mm[1] <= height_mm - 2 * UNPRINTED_MM:
            break
    else:
        raise InputError(
            f"the frame is {frame_mm[0]:.0f} x {frame_mm[1]:.0f} mm, and {needed_mm[0]:.0f} x {needed_mm[1]:.0f} mm "
            f"with its ruler and text; {paper} has room for {short_mm - 2 * UNPRINTED_MM:.0f} x "
            f"{long_mm - 2 * UNPRINTED_MM:.0f} mm, portrait or landscape. Give a larger --paper or a smaller "
            "--size-mm."
        )
    origin_mm = np.array([(width_mm - face_mm[0]) / 2, height_mm - UNPRINTED_MM - band_mm - face_mm[1]])
    # The cutting line is just inside the opening, so that it is cut away.
    (left, low), (across, up) = origin_mm.tolist(), face_mm
    bars = [Bar(left, y, across, CUT_MM, CUT_GREY) for y in (low, low + up - CUT_MM)]
    bars += [Bar(x, low, CUT_MM, up, CUT_GREY) for x in (left, left + across - CUT_MM)]
    for marker in board.markers:
        square, cells = black_modules(board, marker)
        for ring_mm in (square, *cells):
            (x, y), (wide, high) = (ring_mm + origin_mm).min(axis=0).tolist(), np.ptp(ring_mm, axis=0).tolist()
            bars.append(Bar(x, y, wide, high, 0.0 if ring_mm is square else 1.0))
    left_mm, top_mm = (width_mm - CAPTION_WIDTH_MM) / 2, origin_mm[1] - band_mm
    bars += _ruler(left_mm, top_mm - 8)
    title = (
        f"sealtwin markers: {len(board.markers)} of {board.dictionary}, {board.size_mm:g} mm, around a face of "
        f"{face_mm[0]:g} x {face_mm[1]:g} mm"
    )
    lines = [(left_mm + RULER_MM + 4, top_mm - 8, "This ruler must be 100.0 mm long.")]
    lines += [(left_mm, top_mm - 12 - LINE_MM * row, text) for row, text in enumerate((title, *INSTRUCTIONS), start=1)]
    return MarkerFrame((width_mm, height_mm), tuple(bars), tuple(lines), board, face_mm)


def as_pdf(frame: MarkerFrame) -> bytes:
    """Return the page as PDF, marked so that viewers print it unscaled (ISO 32000-1, 12.2: PrintScaling)."""
    from fpdf import FPDF, ViewerPreferences

    page = FPDF(unit="mm", format=frame.size_mm)
    page.set_creation_date(DRAWN_ON)
    page.set_title("sealtwin markers")
    page.viewer_preferences = ViewerPreferences(print_scaling="None")
    page.add_page()
    page.set_font("Helvetica", size=TEXT_PT)
    # fpdf2 counts down from the upper edge.
    top_mm = frame.size_mm[1]
    for x_mm, y_mm, across_mm, up_mm, grey in frame.bars:
        page.set_fill_color(round(255 * grey))
        page.rect(x_mm, top_mm - y_mm - up_mm, across_mm, up_mm, style="F")
    for x_mm, y_mm, text in frame.lines:
        page.text(x_mm, top_mm - y_mm, text)
    return bytes(page.output())


def board_around(
    face_mm: tuple[float, float], size_mm: float, dictionary: Dictionary, count: int, ruler_mm: float | None = None
) -> MarkerBoard:
    """Place markers at the face's corners and, if ``count`` is 8, sides; raise InputError if they would touch."""
    width, height = face_mm
    if not all(LEAST_FACE_MM <= side <= MOST_FACE_MM for side in face_mm):
        raise InputError(
            f"a face of {width:g} x {height:g} mm: a side must be {LEAST_FACE_MM:g} to {MOST_FACE_MM:g} mm; "
            "give --face-mm as width x height of the cracked face, for example 160x40."
        )
    off = size_mm * (0.5 + WHITE)
    columns, rows = ((-off, side / 2, side + off) for side in (width, height))
    if count == 4:
        columns, rows = (columns[0], columns[2]), (rows[0], rows[2])
    apart_mm, needed_mm = min(columns[1] - columns[0], rows[1] - rows[0]), size_mm * (1 + WHITE)
    if apart_mm < needed_mm:
        raise InputError(
            f"{count} markers of {size_mm:g} mm around a face of {width:g} x {height:g} mm would be {apart_mm:.1f} mm "
            f"apart; with white between them they must be at least {needed_mm:.1f} mm apart. Give a smaller "
            "--size-mm, or --count 4."
        )
    places = [(x, y) for y in rows for x in columns if (x, y) != (width / 2, height / 2)]
    markers = tuple(Marker(id=number, x_mm=x, y_mm=y) for number, (x, y) in enumerate(places))
    return MarkerBoard(dictionary=dictionary, size_mm=size_mm, markers=markers, printed_ruler_mm=ruler_mm)


def board_toml(frame: MarkerFrame) -> str:
    """Return the table for a trial file, with the size of the face in a comment."""
    rows = [f"  {{ id = {it.id}, x_mm = {it.x_mm}, y_mm = {it.y_mm} }}," for it in frame.board.markers]
    face = f"# In [photo]: face_mm = {list(frame.face_mm)}"
    size = f'dictionary = "{frame.board.dictionary}"\nsize_mm = {frame.board.size_mm}'
    return "\n".join([face, "[photo.markers]", size, "markers = [", *rows, "]", ""])


def _ruler(left_mm: float, low_mm: float) -> list[Bar]:
    """Draw a ruler with a mark every 10 mm, 100 mm long from the outer edge of the first mark to that of the last."""
    marks = [
        Bar(left_mm + 10 * i - RULER_THICK_MM / 2, low_mm, RULER_THICK_MM, 3.0 if i % 5 else 4.5) for i in range(1, 10)
    ]
    ends = [Bar(left_mm + x, low_mm, RULER_THICK_MM, 4.5) for x in (0.0, RULER_MM - RULER_THICK_MM)]
    return [Bar(left_mm, low_mm, RULER_MM, RULER_THICK_MM), *ends, *marks]
