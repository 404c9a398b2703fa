"""Photos and masks: two inputs that disagree, lines that are no crack, and files that state another tone curve."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from PIL import Image, ImageCms, PngImagePlugin, TiffImagePlugin

from sealtwin.core.records import Floats
from tests.support.photos import mortar, wandering, with_crack, write_png
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


def _linear(folder: Path, stated: Callable[[], dict[str, Any]], name: str = "photo.png") -> None:
    """A picture whose values are light itself, and that says so."""
    values = np.rint(255 * np.clip(_crack(), 0, 1)).astype(np.uint8)
    Image.fromarray(np.dstack([values] * 3)).save(folder / name, **stated())


def _gamma_chunk() -> dict[str, Any]:
    chunks = PngImagePlugin.PngInfo()
    chunks.add(b"gAMA", (100_000).to_bytes(4, "big"))
    return {"pnginfo": chunks}


def _linear_profile() -> dict[str, Any]:
    """The profile of sRGB with straight lines for its curves: a parametric curve of kind 0 and exponent 1."""
    content = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    for curve in re.finditer(b"para", bytes(content[128:])):
        start = 128 + curve.start() + 8
        content[start : start + 8] = bytes([0, 0, 0, 0, 0, 1, 0, 0])
    return {"icc_profile": bytes(content)}


def _exif_gamma() -> dict[str, Any]:
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA500] = 1.0
    return {"exif": exif, "quality": 98}


def _transfer_function() -> dict[str, Any]:
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags[301] = tuple(257 * value for value in range(256)) * 3
    tags.tagtype[301] = 3
    return {"tiffinfo": tags}


def _inks(folder: Path) -> None:
    Image.new("CMYK", SIZE_PX, (0, 0, 0, 90)).save(folder / "photo.jpg")


def _heic(folder: Path, damage: Callable[[bytes], bytes]) -> None:
    (folder / "photo.heic").write_bytes(damage((FIXTURES / "crack.heic").read_bytes()))


def _of_size(content: bytes, side_px: int) -> bytes:
    """Return the file with another size in its header, as a square."""
    start = content.index(b"ispe") + 8
    return content[:start] + 2 * side_px.to_bytes(4, "big") + content[start + 8 :]


def _floats(folder: Path) -> None:
    cv2.imwrite(str(folder / "photo.tif"), np.dstack([_crack().astype(np.float32)] * 3))


def _scan(folder: Path, name: str, stated: Callable[[], dict[str, Any]]) -> None:
    """A picture whose file states twice as many dots across as down."""
    values = np.rint(255 * np.clip(_crack(), 0, 1)).astype(np.uint8)
    Image.fromarray(values).resize((SIZE_PX[0], SIZE_PX[1] // 2)).save(folder / name, **stated())


def _exif_resolution() -> dict[str, Any]:
    exif = Image.Exif()
    exif[282], exif[283] = 254.0, 127.0
    return {"exif": exif}


SCANS: dict[str, Callable[[], dict[str, Any]]] = {
    "photo.tif": lambda: {"resolution_unit": 2, "x_resolution": 254.0, "y_resolution": 127.0},
    "photo.jpg": lambda: {"dpi": (254, 127)},
    "photo.jpeg": _exif_resolution,
    "photo.png": lambda: {"dpi": (254, 127)},
}
HEIC_DAMAGES: tuple[tuple[str, Callable[[bytes], bytes], str], ...] = (
    ("without a primary item", lambda content: content.replace(b"pitm", b"free"), "damaged or cut short"),
    ("that states another size than its picture's", lambda content: _of_size(content, 90), "damaged or cut short"),
    ("that states 3,600 million pixels", lambda content: _of_size(content, 60_000), "50 million pixels"),
    ("that states 56 million pixels", lambda content: _of_size(content, 7_500), "7500 x 7500 pixels"),
)
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
    *(
        clicked(f"pixels that are not square: {name}", partial(_scan, name=name, stated=stated), name, "not square",
            photo=name)
        for name, stated in SCANS.items()
    ),
    clicked("photo of which nobody says where it comes from", lit(_crack), "photo: undeclared", "photo.data", code=0),
    masked("mask mirrored", lambda: _paint()[::-1], "photo.mask", "0%", "mirrored"),
    masked("mask three times as wide as the crack", lambda: _paint(41), "photo.mask", "4.2 mm", "1.5 mm",
        "dark band", "ends_px", code=0),
    masked("a warning with --quiet", lambda: np.roll(_paint(), 8, 0), "note: photo.mask", "8 px away",
        more=" --quiet", code=0, lacks=("Digitising",)),
    clicked("option given twice", lit(_crack), "--depth-mm", "2 times", more=" --depth-mm 12", code=2),
    masked("mask of a bright crack, with its ends", _paint, "photo.mask", "median brightness",
        more=" --ends 22,60 398,110", light=_bright, code=0),
    masked("mask of a line", lambda: _paint(1), "photo.mask", "(1 px)", "line", "ends_px"),
    masked("mask of an outline", lambda: np.where(_paint(12) > 0, 0, _paint(20)).astype(np.uint8), "photo.mask",
        "only an outline", "whole crack"),
    masked("mask of 0 and 1", lambda: _paint() // 255, "mask.png", "1 of 255", "class numbers"),
    masked("mask in green", lambda: (_paint()[..., None] > 0) * np.array((0, 120, 0), np.uint8), "70 of 255"),
    masked("mask of classes", _classes, "brightness 120 of 255", "class numbers"),
    masked("mask of 16 bits", lambda: np.uint16(257) * _paint(), "mask.png", "8 bits per channel", "PNG"),
    answers(MASKED)("mask cut short",
        lambda path: (_masked(_paint, path), (path / "mask.png").write_bytes((path / "mask.png").read_bytes()[:300])),
        "mask.png", "damaged"),
    masked("mask exchanged", lambda: 255 - _paint(), "exchanged"),
    masked("mask half transparent", lambda: np.dstack([*[_paint()] * 3, np.full_like(_paint(), 100)]), "100 of 255"),
    clicked("crack brighter than its ground", lit(_bright), "bright"),
    followed("path of a crack brighter than its ground", lit(_bright), "bright", "photo.mask",
        more=" --ends 22,60 398,110"),
    followed("path that jumps to a joint", _hairline_beside_a_joint, "photo.via_px", "px from (",
        more=" --ends 130,6 139,414", code=0),
    digitised("wide crack at the border, clicked", _wedge, "left out at the edge of the photo",
        more=" --ends 14,130 540,363", lacks=("inside photo.roi_px",), code=0),
    digitised("wide crack at the border, clicked at its wall", _wedge, "along a dark region", "border",
        "photo.mask", more=" --ends 2,66 540,363"),
    digitised("two cracks alike", lit(lambda: with_crack(with_crack(mortar(SIZE_PX), wandering([(30, 50), (390, 65)])),
        wandering([(30, 210), (390, 195)]))), "photo.crack", "ends_px"),
    clicked("black crack in coarse ground", _coarse, "too coarse", "overlay.png", code=0),
    digitised("ends on a part of the crack", lit(_crack), "continues beyond the end (10", more=" --ends 100,78 390,107",
        code=0),
    clicked("PNG of gamma 1", partial(_linear, stated=_gamma_chunk), "photo.png", "gamma 1", "PNG gAMA", "sRGB"),
    clicked("ICC profile of gamma 1", partial(_linear, stated=_linear_profile), "tone curve", "ICC", "sRGB"),
    clicked("JPEG of gamma 1", partial(_linear, stated=_exif_gamma, name="photo.jpg"), "gamma 1", "EXIF Gamma",
        photo="photo.jpg"),
    clicked("TIFF of gamma 1", partial(_linear, stated=_transfer_function, name="photo.tif"), "TransferFunction",
        "sRGB", photo="photo.tif"),
    clicked("unreadable ICC profile", partial(_linear, stated=lambda: {"icc_profile": b"?" * 200}), "ICC", "sRGB"),
    *(
        clicked(f"HEIC {name}", partial(_heic, damage=damage), "photo.heic", says, photo="photo.heic")
        for name, damage, says in HEIC_DAMAGES
    ),
    clicked("CMYK without its marker", _inks, "CMYK", "RGB", photo="photo.jpg"),
    clicked("TIFF of floats", _floats, "TIFF", "8 bits", photo="photo.tif"),
]
# fmt: on
