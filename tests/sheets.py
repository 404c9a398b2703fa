"""Read a printable page back, without the code that wrote it."""

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pypdf

from digitise.specimens.rendering import coverage
from sealtwin.records import Floats

NUMBER = r"(-?[\d.]+)"
MM_PER_PT = 25.4 / 72


@dataclass(frozen=True)
class Page:
    """What is drawn on a page, in drawing order."""

    size_mm: tuple[float, float]
    bars: list[tuple[float, ...]]
    """x, y of the lower left corner, width, height, all in mm, and grey from 0 to 1."""
    text: str

    def light(self, px_per_mm: float) -> Floats:
        """As a scanner would see it, in linear light: y down, pixel centres whole numbers."""
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
    contents = page.get_contents()
    assert contents is not None
    drawn = contents.get_data().decode("ascii")
    (scale,) = re.findall(rf"^{NUMBER} 0 0 \1 0 0 cm$", drawn, re.MULTILINE)
    mm = float(scale) * MM_PER_PT
    found = re.findall(rf"{NUMBER} g {NUMBER} {NUMBER} {NUMBER} {NUMBER} re f", drawn)
    bars = [(*(float(value) * mm for value in bar[1:]), float(bar[0])) for bar in found]
    box = page.mediabox
    return Page((float(box.width) * MM_PER_PT, float(box.height) * MM_PER_PT), bars, page.extract_text())


def read_svg(path: Path) -> Page:
    root = ET.fromstring(path.read_text())
    width, height = (float(root.attrib[side].removesuffix("mm")) for side in ("width", "height"))
    assert root.attrib["viewBox"] == f"0 0 {width:g} {height:g}"
    bars = []
    for rect in root.iter("{http://www.w3.org/2000/svg}rect"):
        x, y, wide, high = (float(rect.attrib[name]) for name in ("x", "y", "width", "height"))
        grey = int(re.findall(r"rgb\((\d+),", rect.attrib["fill"])[0]) / 255
        bars.append((x, height - y - high, wide, high, grey))
    text = "\n".join(it.text or "" for it in root.iter("{http://www.w3.org/2000/svg}text"))
    return Page((width, height), bars, text)
