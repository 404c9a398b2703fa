"""Read a printable page back, without the code that wrote it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pypdf
import pypdf.generic

from digitise.geometry.polyline import coverage
from sealtwin.core.records import Floats

MM_PER_PT = 25.4 / 72


@dataclass(frozen=True)
class Page:
    """Rectangles and text of a page, in drawing order, without the white of the paper."""

    size_mm: tuple[float, float]
    bars: list[tuple[float, ...]]
    """x, y of the lower left corner, width, height, all in mm, and grey from 0 to 1."""
    text: str

    def light(self, px_per_mm: float) -> Floats:
        """Return a scan of the page in linear light: y down, pixel centres whole numbers."""
        width, height = self.size_mm
        size_px = (round(width * px_per_mm), round(height * px_per_mm))
        light = np.full(size_px[::-1], 0.9)
        for x, y, wide, high, grey in self.bars:
            corners_mm = np.array([[x, y], [x + wide, y], [x + wide, y + high], [x, y + high]])
            ring_px = np.column_stack([corners_mm[:, 0], height - corners_mm[:, 1]]) * px_per_mm - 0.5
            left, top = np.maximum(np.floor(ring_px.min(axis=0)).astype(int), 0)
            right, bottom = np.minimum(np.ceil(ring_px.max(axis=0)).astype(int) + 1, size_px)
            window = light[top:bottom, left:right]
            window += coverage(ring_px - (left, top), (right - left, bottom - top)) * (0.03 + 0.87 * grey - window)
        return light


def read_pdf(path: Path) -> Page:
    reader = pypdf.PdfReader(path, strict=True)
    (page,) = reader.pages
    size_pt = np.array([page.mediabox.width, page.mediabox.height], dtype=float)
    grey, pen, moved, corners_pt, bars = 0.0, 0.0, False, [], []
    for operands, operator in pypdf.generic.ContentStream(page.get_contents(), reader).operations:
        match operator:
            case b"g":
                grey = float(operands[0])
            case b"G":
                pen = float(operands[0])
            case b"cm":
                moved = True
            case b"re":
                corners_pt += [[float(value) for value in operands]]
            case b"f" | b"S":
                assert not moved
                ((x, y, wide, high),) = corners_pt
                corners_pt = []
                shade = grey if operator == b"f" else pen
                bars.append((*np.array([x, y + min(high, 0), wide, abs(high)]) * MM_PER_PT, shade))
            case b"rg" | b"k" | b"sc" | b"scn" | b"B" | b"c" | b"l":
                raise AssertionError(f"{operator}: this reader expects grey bars and lines around them")
    return Page(tuple(size_pt * MM_PER_PT), bars, page.extract_text())
