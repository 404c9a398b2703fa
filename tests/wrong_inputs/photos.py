"""Wrong photos and masks: inputs that disagree, lines that are no crack, and faulty files."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from PIL import Image

from sealtwin.core.records import Floats
from tests.support.photos import mortar, with_crack, write_png
from tests.wrong_inputs.table import WrongInput, answers

Make = Callable[[Path], object]
Draw = Callable[[], np.ndarray]
SIZE_PX = (420, 260)
CRACK = [(20.0, 60.0), (150.0, 90.0), (260.0, 75.0), (400.0, 110.0)]
DIGITISE = "digitise {given}/photo.png --depth-mm 10 --mm-per-px 0.1 --out {out}"
CLICKED = f"{DIGITISE} --ends 22,60 398,110"
FIXTURES = Path(__file__).parents[2] / "fixtures" / "heic"
MASKED = f"{DIGITISE} --mask {{given}}/mask.png"


def _crack(width_px: int = 14) -> Floats:
    return with_crack(mortar(SIZE_PX), CRACK, width_px)


def _paint(width_px: int = 14) -> np.ndarray:
    paint = np.zeros(SIZE_PX[::-1], dtype=np.uint8)
    cv2.polylines(paint, [np.array(CRACK, dtype=np.int32)], False, 255, width_px)
    return paint


def _masked(mask: Draw, folder: Path, light: Draw = _crack) -> None:
    """A crack and a mask of this picture, (height, width) or with channels."""
    write_png(folder / "photo.png", light())
    Image.fromarray(mask()).save(folder / "mask.png")


def _bright() -> Floats:
    return np.where(_paint() > 0, 0.9, mortar(SIZE_PX))


def _classes() -> np.ndarray:
    """The crack in grey, and a marking in white."""
    paint = np.where(_paint() > 0, 120, 0).astype(np.uint8)
    paint[200:230, 40:380] = 255
    return paint


def _hairline_beside_a_joint(folder: Path) -> None:
    light, y = mortar((300, 420), 3), np.arange(4.0, 416)
    x = 130 + 10 * np.sin(y / 55)
    light = np.where(_line(light.shape, x, y, 1), 0.85 * light, light)
    write_png(folder / "photo.png", np.where(_line(light.shape, np.full(len(y), 170.0), y, 4), 0.1 * light, light))


def _line(shape: tuple[int, ...], x: Floats, y: Floats, width_px: int) -> np.ndarray:
    cover = np.zeros(shape, dtype=np.uint8)
    cv2.polylines(cover, [np.column_stack([x, y]).round().astype(np.int32)], False, 1, width_px)
    return cover > 0


def _wedge(folder: Path) -> None:
    """A crack that is 120 px wide at the photo's border and narrows to 10 px."""
    cover = np.zeros((460, 600), dtype=np.float32)
    cv2.fillPoly(cover, [np.array([(0, 60), (150, 190), (545, 360), (540, 370), (120, 230), (0, 200)])], 1.0)
    write_png(folder / "photo.png", mortar((600, 460)) * (1 - 0.99 * cv2.GaussianBlur(cover, (0, 0), 0.5)))


def _coarse(folder: Path) -> None:
    """Stones as dark as half of a black crack's contrast."""
    stones = cv2.GaussianBlur(np.random.default_rng(5).standard_normal(SIZE_PX[::-1]), (0, 0), 5.0)
    write_png(folder / "photo.png", with_crack(0.3 * np.exp(1.1 * stones / stones.std()), CRACK, 18))


def _profiled(folder: Path) -> None:
    values = np.rint(255 * np.clip(_crack(), 0, 1)).astype(np.uint8)
    Image.fromarray(np.dstack([values] * 3)).save(folder / "photo.png", icc_profile=b"?" * 200)


def _inks(folder: Path) -> None:
    Image.new("CMYK", SIZE_PX, (0, 0, 0, 90)).save(folder / "photo.jpg")


def _heic(folder: Path, damage: Callable[[bytes], bytes]) -> None:
    (folder / "photo.heic").write_bytes(damage((FIXTURES / "crack.heic").read_bytes()))


def _gigapixels(content: bytes) -> bytes:
    start = content.index(b"ispe") + 8
    return content[:start] + 2 * (60_000).to_bytes(4, "big") + content[start + 8 :]


def _scan(folder: Path) -> None:
    """A picture whose file states twice as many dots across as down."""
    values = np.rint(255 * np.clip(_crack(), 0, 1)).astype(np.uint8)
    Image.fromarray(values).resize((SIZE_PX[0], SIZE_PX[1] // 2)).save(folder / "photo.png", dpi=(254, 127))


digitised = answers(DIGITISE)
followed = answers(f"{DIGITISE} --set photo.path_only=true".replace("--depth-mm 10 ", ""))


def lit(light: Draw) -> Make:
    return lambda folder: write_png(folder / "photo.png", light())


def clicked(name: str, make: Make, *names: str, photo: str = "photo.png", **others: Any) -> WrongInput:
    return answers(CLICKED.replace("photo.png", photo))(name, make, *names, **others)


def masked(name: str, mask: Draw, *names: str, light: Draw = _crack, **others: Any) -> WrongInput:
    return answers(MASKED)(name, partial(_masked, mask, light=light), *names, **others)


# fmt: off
CASES: list[WrongInput] = [
    clicked("pixels that are not square", _scan, "photo.png", "not square"),
    clicked("photo without a stated origin", lit(_crack), "origin of the photo undeclared", code=0),
    masked("mask mirrored", lambda: _paint()[::-1], "photo.mask", "0%", "mirrored"),
    masked("a warning with --quiet", lambda: np.roll(_paint(), 8, 0), "note: photo.mask", "8 px away",
        more=" --quiet", code=0, lacks=("Digitising",)),
    masked("mask of a bright crack, with its ends", _paint, "photo.mask", "median brightness",
        more=" --ends 22,60 398,110", light=_bright, code=0),
    masked("mask of a line", lambda: _paint(1), "photo.mask", "(1 px)", "line", "ends_px"),
    masked("mask of classes", _classes, "brightness 120 of 255", "class numbers"),
    answers(MASKED)("mask cut short",
        lambda path: (_masked(_paint, path), (path / "mask.png").write_bytes((path / "mask.png").read_bytes()[:300])),
        "mask.png", "damaged"),
    followed("path of a crack brighter than its ground", lit(_bright), "bright", "photo.mask",
        more=" --ends 22,60 398,110", code=0),
    followed("path that jumps to a joint", _hairline_beside_a_joint, "photo.via_px", "as straight as a joint",
        more=" --ends 130,6 139,414", code=0),
    digitised("wide crack at the border, clicked at its wall", _wedge, "bridged", "left out",
        more=" --ends 2,66 540,363", code=0),
    clicked("black crack in coarse ground", _coarse, "too coarse", "overlay.png", code=0),
    clicked("unreadable ICC profile", _profiled, "ICC", "sRGB"),
    clicked("HEIC without a primary item", partial(_heic, damage=lambda content: content.replace(b"pitm", b"free")),
        "photo.heic", "damaged or cut short", photo="photo.heic"),
    clicked("HEIC that states 3,600 million pixels", partial(_heic, damage=_gigapixels), "photo.heic",
        "50 million pixels", photo="photo.heic"),
    clicked("CMYK without its marker", _inks, "CMYK", "RGB", photo="photo.jpg"),
]
# fmt: on
