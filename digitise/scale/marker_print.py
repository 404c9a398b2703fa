"""Draw a frame of markers to print, cut out and lay level with a sample's face, and its table for the trial file."""

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import Field

from digitise.scale.marker_scale import RULER_MM, black_modules
from digitise.settings import Dictionary, FaceSide, Marker, MarkerBoard
from sealtwin.core.errors import InputError
from sealtwin.core.settings import Settings

if TYPE_CHECKING:
    from fpdf import FPDF

PAPERS_MM = {"a4": (210.0, 297.0), "a3": (297.0, 420.0), "letter": (215.9, 279.4)}
UNPRINTED_MM = 6.0  # Unprintable margin along the edge of the paper
WHITE = 0.375  # White margin around a marker over its side: detection needs a sixth, the rest is for cutting by hand
CUT_GREY, CUT_MM = 191, 0.1  # Line to cut along, too light to be found as the edge of the face
RULER_THICK_MM, MARK_MM = 0.3, 4.0  # Of the ruler's lines, and of its marks every 10 mm
LEAST_FACE_MM, MOST_FACE_MM = 5.0, 400.0  # Smallest and largest side of a frame's opening
LINE_MM = 4.5  # Distance between lines of text
CAPTION_MM = 12.0 + 5 * LINE_MM  # Height of the ruler and five lines of text below the frame
CAPTION_WIDTH_MM = 165.0
TEXT_PT = 8.5  # Height of the font

INSTRUCTIONS = (
    'Print at 100 % ("actual size", not "fit to page"), on matt paper or card, and glue it flat.',
    "Measure the ruler, and add printed_ruler_mm = (its length) to [photo.markers].",
    "Cut out the opening, and lay the frame level with the cracked face, with this text upright in the photo.",
    "Each mm above or below the face changes every length by 1 mm / distance to the camera: 0.33 % at 300 mm.",
)


class MarkerFrame(Settings):
    """A frame of markers to print: options of 'sealtwin markers'."""

    face_mm: tuple[FaceSide, FaceSide]
    """Size of the sample's face, which is the opening of the frame."""
    size_mm: float = Field(default=16.0, ge=5, le=200)
    """Outer edge of a marker's black square."""
    dictionary: Dictionary = "4x4_50"
    """Dictionary of the markers: cells across and number of markers, or an AprilTag family."""
    count: Literal["4", "8"] = "8"
    """4: at the corners of the face; 8: also in the middle of its sides."""
    paper: Literal["a4", "a3", "letter"] = "a4"
    """Size of the paper, portrait or landscape."""


def frame_pdf(face_mm: tuple[float, float], board: MarkerBoard, paper: str) -> bytes:
    """Draw the frame on a paper of ``PAPERS_MM``, either way up; raise InputError if it does not fit.

    The PDF is marked so that viewers print it unscaled (ISO 32000-1, 12.2: PrintScaling).
    """
    from fpdf import FPDF, ViewerPreferences

    band_mm = board.size_mm * (1 + 2 * WHITE)
    wide_mm, high_mm = np.add(face_mm, 2 * band_mm).tolist()
    needed_mm = np.array([max(wide_mm, CAPTION_WIDTH_MM), high_mm + CAPTION_MM]) + 2 * UNPRINTED_MM
    short_mm, long_mm = PAPERS_MM[paper]
    fitting_mm = [mm for mm in ((short_mm, long_mm), (long_mm, short_mm)) if np.all(needed_mm <= mm)]
    if not fitting_mm:
        raise InputError(
            f"the frame needs {needed_mm[0]:.0f} x {needed_mm[1]:.0f} mm with its ruler, text and unprinted edge; "
            f"{paper} has {short_mm:g} x {long_mm:g} mm, portrait or landscape. Give a larger "
            "--paper or a smaller --size-mm."
        )
    page = FPDF(unit="mm", format=fitting_mm[0])
    # A frame drawn again is the same file.
    page.set_creation_date(datetime(2026, 1, 1, tzinfo=UTC))
    page.viewer_preferences = ViewerPreferences(print_scaling="None")
    page.add_page()
    page.set_font("Helvetica", size=TEXT_PT)
    # Places are to the right of and below the paper's upper left corner; those of the table are above the face's lower.
    left_mm, low_mm = (page.w - face_mm[0]) / 2, UNPRINTED_MM + band_mm + face_mm[1]
    page.set_draw_color(CUT_GREY)
    page.set_line_width(CUT_MM)
    # The line to cut along is just inside the opening, so that it is cut away.
    page.rect(left_mm + CUT_MM / 2, low_mm - face_mm[1] + CUT_MM / 2, face_mm[0] - CUT_MM, face_mm[1] - CUT_MM)
    for marker in board.markers:
        square, cells = black_modules(board, marker)
        for ring_mm, grey in ((square, 0), *((cell, 255) for cell in cells)):
            page.set_fill_color(grey)
            (x, y), (wide, high) = ring_mm[0].tolist(), np.ptp(ring_mm, axis=0).tolist()
            page.rect(left_mm + x, low_mm - y, wide, high, style="F")
    _draw_caption(page, low_mm + band_mm + 8, face_mm, board)
    return bytes(page.output())


def _draw_caption(page: "FPDF", top_mm: float, face_mm: tuple[float, float], board: MarkerBoard) -> None:
    """Draw the ruler and the text below the frame."""
    left_mm = (page.w - CAPTION_WIDTH_MM) / 2
    page.set_fill_color(0)
    page.rect(left_mm, top_mm - RULER_THICK_MM, RULER_MM, RULER_THICK_MM, style="F")
    # The ruler is 100 mm long from the outer edge of its first mark to that of its last.
    for x in np.clip(10.0 * np.arange(11) - RULER_THICK_MM / 2, 0, RULER_MM - RULER_THICK_MM).tolist():
        page.rect(left_mm + x, top_mm - MARK_MM, RULER_THICK_MM, MARK_MM, style="F")
    page.text(left_mm + RULER_MM + 4, top_mm, "This ruler must be 100.0 mm long.")
    title = (
        f"sealtwin markers: {len(board.markers)} of {board.dictionary}, {board.size_mm:g} mm, around a face of "
        f"{face_mm[0]:g} x {face_mm[1]:g} mm"
    )
    for row, text in enumerate((title, *INSTRUCTIONS), 1):
        page.text(left_mm, top_mm + 4 + LINE_MM * row, text)


def board_around(
    face_mm: tuple[float, float], size_mm: float, dictionary: Dictionary, count: int, ruler_mm: float | None = None
) -> MarkerBoard:
    """Place markers at the face's corners and, if ``count`` is 8, sides; raise InputError if they would touch."""
    width, height = face_mm
    off, needed_mm = size_mm * (0.5 + WHITE), size_mm * (1 + WHITE)
    columns, rows = ((-off, side / 2, side + off)[:: 1 if count == 8 else 2] for side in face_mm)
    apart_mm = min(columns[1] - columns[0], rows[1] - rows[0])
    if apart_mm < needed_mm or not all(LEAST_FACE_MM <= side <= MOST_FACE_MM for side in face_mm):
        raise InputError(
            f"{count} markers of {size_mm:g} mm around a face of {width:g} x {height:g} mm would be {apart_mm:.1f} mm "
            f"apart; they must be at least {needed_mm:.1f} mm apart, and sides of the face {LEAST_FACE_MM:g} to "
            f"{MOST_FACE_MM:g} mm. Give --face-mm as width x height, a smaller --size-mm, or --count 4."
        )
    places = [(x, y) for y in rows for x in columns if (x, y) != (width / 2, height / 2)]
    markers = tuple(Marker(id=number, x_mm=x, y_mm=y) for number, (x, y) in enumerate(places))
    return MarkerBoard(dictionary=dictionary, size_mm=size_mm, markers=markers, printed_ruler_mm=ruler_mm)


def board_toml(face_mm: tuple[float, float], board: MarkerBoard) -> str:
    """Return the table for a trial file, with the size of the face in a comment."""
    rows = [f"  {{ id = {it.id}, x_mm = {it.x_mm}, y_mm = {it.y_mm} }}," for it in board.markers]
    head = f"# In [photo]: face_mm = {list(face_mm)}\n[photo.markers]"
    size = f'dictionary = "{board.dictionary}"\nsize_mm = {board.size_mm}\nmarkers = ['
    return "\n".join([head, size, *rows, "]", ""])
