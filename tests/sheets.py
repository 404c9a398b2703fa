"""Read a printable page back, without the code that wrote it."""

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pypdf
import pypdf.generic
import pytest

from sealtwin.core.coverage import coverage
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
    grey, moved, saved, corners_pt, bars = 0.0, False, [], [], []
    for operands, operator in pypdf.generic.ContentStream(page.get_contents(), reader).operations:
        match operator:
            case b"q":
                saved.append((grey, moved))
            case b"Q":
                grey, moved = saved.pop()
            case b"g":
                grey = float(operands[0])
            case b"m" | b"l":
                corners_pt.append([float(value) for value in operands])
            case b"n":
                corners_pt = []
            case b"cm":
                moved = True
            case b"f":
                assert not moved
                bars.append(_bar(np.array(corners_pt), grey))
                corners_pt = []
            case b"rg" | b"k" | b"sc" | b"scn" | b"S" | b"B" | b"c":
                raise AssertionError(f"{operator}: this reader expects filled grey bars")
    assert bars[0] == pytest.approx((0, 0, *size_pt * MM_PER_PT, 1), abs=1e-3), "paper"
    return Page(tuple(size_pt * MM_PER_PT), bars[1:], page.extract_text())


def read_svg(path: Path) -> Page:
    root = ET.parse(path).getroot()
    size_pt = np.array([float(root.attrib[side].removesuffix("pt")) for side in ("width", "height")])
    assert [float(number) for number in root.attrib["viewBox"].split()] == [0, 0, *size_pt]
    bars = []
    for drawn in root.iter("{http://www.w3.org/2000/svg}path"):
        commands = drawn.attrib["d"].split()
        assert [it for it in commands if it.isalpha()] == ["M", "L", "L", "L", "z"]
        corners_pt = np.array([float(it) for it in commands if not it.isalpha()]).reshape(-1, 2)
        style = re.fullmatch(r"fill: #(..)\1\1", drawn.get("style", "fill: #000000"))
        assert style is not None
        bars.append(_bar([0, size_pt[1]] + corners_pt * [1, -1], int(style[1], 16) / 255))
    assert bars[0] == pytest.approx((0, 0, *size_pt * MM_PER_PT, 1), abs=1e-3), "paper"
    text = "\n".join(it.text or "" for it in root.iter("{http://www.w3.org/2000/svg}text"))
    return Page(tuple(size_pt * MM_PER_PT), bars[1:], text)


def _bar(corners_pt: Floats, grey: float) -> tuple[float, ...]:
    assert corners_pt.shape == (4, 2)
    low_mm, high_mm = corners_pt.min(axis=0) * MM_PER_PT, corners_pt.max(axis=0) * MM_PER_PT
    return (*low_mm, *(high_mm - low_mm), grey)
