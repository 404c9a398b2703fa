"""What the product makes of one real photo: between two clicks, without clicks, and of a crop of bare ground."""

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchmarks.real_roads_photos import Crop, Listed, Mask, digest, read_mask, read_picture, read_sets
from benchmarks.real_roads_rules import Branch, Verdict, is_hit, is_silent, verdict, width_ratio
from digitise.crack_path.find_path import CrackSearch, RivalCracksError, find_path
from digitise.crack_path.hints import CrackPath
from digitise.outline import trace_outline
from digitise.photo import Photo, load_photo
from digitise.settings import PhotoInput
from sealtwin.core.errors import InputError
from sealtwin.core.facts import texts
from sealtwin.core.records import Floats, Outline

MM_PER_PX = 0.1
"""No scale is given; the warnings in mm read like those of a photo from near."""
BRANCH, LINE, WALL, CLICK = (0, 200, 0), (255, 0, 0), (255, 200, 0), (255, 0, 255)


@dataclass(frozen=True)
class Clicked:
    """A photo traced between two clicks."""

    of: Listed
    verdict: Verdict
    words: str
    """The refusal or, of a wrong line, its warnings."""
    silent: bool = False
    width_ratio: float = float("nan")
    """Traced mean width over the mask's, if the trace is right and has one."""
    time_s: float = 0.0


@dataclass(frozen=True)
class Unclicked:
    """A photo or a crop without clicks."""

    of: Listed | Crop
    hits: Sequence[bool]
    """Of the lines that are offered, best first."""
    alone: bool
    """True if a path is returned without a question."""
    hit: bool
    """True if that path is on a crack."""
    traced: bool
    """True if that path gets an outline too: the command ends with 0."""
    words: str = ""
    time_s: float = 0.0


def run_clicked(row: Listed, photos: Path, overlays: Path | None) -> Clicked:
    picture, mask, branch = _truth(row, photos)
    settings = _settings(photos / row.set / row.photo, row.ends_px)
    began = time.process_time()
    try:
        photo = load_photo(settings, photos)
        outline = trace_outline(photo, find_path(photo, *settings.hints), settings)
    except InputError as refusal:
        clicked = Clicked(row, "refused", _plain(refusal), time_s=time.process_time() - began)
        _draw(overlays, f"refused-{_name(row)}", picture, mask, branch, row)
        return clicked
    time_s, line_px = time.process_time() - began, outline.centreline_px
    judged = verdict(line_px, branch, mask)
    _draw(overlays, f"{judged}-{_name(row)}", picture, mask, branch, row, line_px, outline)
    ratio = float("nan")
    if judged == "right" and outline.width_source in ("walls", "fit"):
        ratio = width_ratio(line_px, outline.mean_width_mm / MM_PER_PX, branch)
    silent = judged == "wrong" and is_silent(line_px, mask, texts(outline.warnings))
    return Clicked(row, judged, "; ".join(texts(outline.warnings)), silent, ratio, time_s)


def run_unclicked(row: Listed, photos: Path, overlays: Path | None) -> Unclicked:
    picture, mask, branch = _truth(row, photos)
    settings = _settings(photos / row.set / row.photo)
    answer, line_px = _searched(row, settings, lambda line: is_hit(line, branch, mask))
    if line_px is not None and not answer.hit:
        _draw(overlays, f"alone-{_name(row)}", picture, mask, branch, None, line_px)
    return answer


def run_bare(crop: Crop, photos: Path, overlays: Path | None) -> Unclicked:
    """Search the crop, in a file of its own, where every line is none."""
    picture = crop.of(read_picture(_content(photos, crop.set, crop.photo, crop.photo_sha256)))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "crop.png"
        Image.fromarray(picture).save(file)
        answer, line_px = _searched(crop, _settings(file), lambda line: False)
    if line_px is not None:
        _draw(overlays, f"bare-{crop.kind}-{_name(crop)}", picture, None, None, None, line_px)
    return answer


def _searched(
    of: Listed | Crop, settings: PhotoInput, is_crack: Callable[[Floats], bool]
) -> tuple[Unclicked, Floats | None]:
    """Return the answer without clicks, and the path that is picked alone, or None."""
    began = time.process_time()
    photo = load_photo(settings, settings.file.parent)
    search = CrackSearch.of(photo)
    hits = [is_crack(one.line_px) for one in search.cracks]
    try:
        path = search.path()
    except InputError as refusal:
        words = "rivals" if isinstance(refusal, RivalCracksError) else _plain(refusal)
        return Unclicked(of, hits, False, False, False, words, time.process_time() - began), None
    words = _outline_words(photo, path, settings)
    answer = Unclicked(of, hits, True, is_crack(path.points_px), not words, words, time.process_time() - began)
    return answer, path.points_px


def _outline_words(photo: Photo, path: CrackPath, settings: PhotoInput) -> str:
    """Return the refusal of a path's outline, or nothing."""
    try:
        trace_outline(photo, path, settings)
    except InputError as refusal:
        return _plain(refusal)
    return ""


def _truth(row: Listed, photos: Path) -> tuple[NDArray[np.uint8], Mask, Branch]:
    picture = read_picture(_content(photos, row.set, row.photo, row.photo_sha256))
    content = _content(photos, row.set, row.mask, row.mask_sha256)
    mask = read_mask(content, row.mask, read_sets()[row.set].least_value, (picture.shape[1], picture.shape[0]))
    branch = Branch.of(mask)
    if abs(branch.length_px - row.branch_px) > 0.1:
        raise SystemExit(f"{row.photo}: the branch is {branch.length_px:.1f} px long, in the list {row.branch_px} px.")
    return picture, mask, branch


def _content(photos: Path, one_set: str, path: str, sha256: str) -> bytes:
    file = photos / one_set / path
    if not file.exists() or digest(content := file.read_bytes()) != sha256:
        raise SystemExit(f"{file} is missing or not the listed file: see python -m benchmarks.real_roads_photos --help")
    return content


def _settings(file: Path, ends_px: tuple[tuple[float, float], tuple[float, float]] | None = None) -> PhotoInput:
    return PhotoInput(file=file.resolve(), data="measured", mm_per_px=MM_PER_PX, scale_is="assumed", ends_px=ends_px)


def _plain(refusal: InputError) -> str:
    """Return the product's sentence without the file's name."""
    return str(refusal).partition(": ")[2]


def _name(of: Listed | Crop) -> str:
    place = f"-{of.left_px}-{of.top_px}" if isinstance(of, Crop) else ""
    return f"{of.set}-{Path(of.photo).stem}{place}"


def _draw(
    folder: Path | None,
    name: str,
    picture: NDArray[np.uint8],
    mask: Mask | None,
    branch: Branch | None,
    clicks: Listed | None,
    line_px: Floats | None = None,
    outline: Outline | None = None,
) -> None:
    """Draw mask in blue, branch in green, clicks in pink, line in red and walls in yellow, at most 4 times as large."""
    if folder is None:
        return
    times = max(1, min(4, 1200 // max(picture.shape[:2])))
    drawn = cv2.resize(picture, None, fx=times, fy=times, interpolation=cv2.INTER_NEAREST_EXACT)
    if mask is not None:
        large = cv2.resize(mask.astype(np.uint8), None, fx=times, fy=times, interpolation=cv2.INTER_NEAREST_EXACT)
        rims, _ = cv2.findContours(large, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(drawn, rims, -1, (0, 80, 255), 1)
    lines = [] if branch is None else [(branch.line_px, BRANCH)]
    if outline is not None and outline.width_source != "none":
        lines += [(outline.left_wall_px, WALL), (outline.right_wall_px, WALL)]
    if line_px is not None:
        lines.append((line_px, LINE))
    for points_px, colour in lines:
        cv2.polylines(drawn, [np.rint(times * points_px + (times - 1) / 2).astype(np.int32)], False, colour, 1)
    for x, y in clicks.ends_px if clicks else ():
        cv2.circle(drawn, (round(times * x), round(times * y)), 8, CLICK, 2)
    folder.mkdir(parents=True, exist_ok=True)
    Image.fromarray(drawn).save(folder / f"{name}.png")
