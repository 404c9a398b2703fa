"""Files that reports of several kinds need, made in a folder by code: no foreign content is in them."""

from pathlib import Path

import numpy as np

from tests.slow.reports.table import Maker
from tests.support.lab_folder import DEFAULTS, S_MM, levels_mm
from tests.support.photos import mortar, with_crack, write_png
from tests.support.sheet_writers import Hand, write_sheet

CRACK_PX = [(40, 150), (250, 140), (460, 160)]
WIDTH_PX = 20


def photo(folder: Path, name: str = "photo.png", width_px: int = WIDTH_PX) -> Path:
    return write_png(folder / name, with_crack(mortar(), CRACK_PX, width_px))


def grey(width_px: int = WIDTH_PX) -> np.ndarray:
    light = with_crack(mortar(), CRACK_PX, width_px)
    return np.rint(255 * np.clip(light, 0, 1) ** (1 / 2.2)).astype(np.uint8)


def text(name: str, *lines: str) -> Maker:
    """Return a function that writes a file of lines."""

    def make(folder: Path) -> None:
        (folder / name).write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")

    return make


def lab(folder: Path) -> None:
    """Write a lab's folder of one sample."""
    small_crack(folder / "P01.png")
    write_sheet(folder / "P01.csv", Hand(), S_MM, levels_mm("P01"))
    (folder / "lab.toml").write_text(DEFAULTS, encoding="utf-8")


def small_crack(path: Path, seed: int = 1, width_px: int = 20) -> None:
    """Write the photo of a crack 12 mm long and 2 mm wide, at 0.1 mm per pixel."""
    crack_px = [(40, 101), (80, 97), (120, 103), (160, 98)]
    write_png(path, with_crack(mortar((200, 200), seed=seed), crack_px, width_px))
