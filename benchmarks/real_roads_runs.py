"""What the product makes of one real photo: between two clicks, and without clicks."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.real_roads_photos import Listed, Mask, digest, read_mask, read_picture, read_sets
from benchmarks.real_roads_rules import Branch, Verdict, is_hit, verdict
from digitise.crack_path.find_path import CrackSearch, find_path
from digitise.outline import trace_outline
from digitise.photo import Photo, load_photo
from digitise.settings import PhotoInput
from sealtwin.core.errors import InputError
from sealtwin.core.facts import of_keys, texts

MM_PER_PX = 0.1
"""No scale is given; the warnings in mm read like those of a photo from near."""


@dataclass(frozen=True)
class Clicked:
    """A photo traced between two clicks."""

    row: Listed
    verdict: Verdict
    words: str
    """The refusal or, of a wrong line, its warnings."""
    silent: bool = False
    """True if there is no caution about the path."""
    walls: bool = False
    """True if there is a remark about the walls, such as that a thin crack was fitted."""
    holds: bool | None = None
    """Whether the width's interval holds the mean width of the mask along its branch. None without an interval."""


@dataclass(frozen=True)
class Unclicked:
    """A photo without clicks."""

    hits: Sequence[bool]
    """Of the lines that are offered, best first."""


def run_clicked(row: Listed, photos: Path) -> Clicked:
    mask, branch = truth_of(row, photos)
    settings = _settings(photos / row.set / row.photo, row.ends_px)
    try:
        photo = load_photo(settings, photos)
        outline = trace_outline(photo, find_path(photo, *settings.hints), settings)
    except InputError as refusal:
        return Clicked(row, "refused", str(refusal).partition(": ")[2])
    line_px = outline.centreline_px
    judged = verdict(line_px, branch, mask)
    silent = not of_keys(outline.warnings, "path.doubtful")
    walls = bool(of_keys(outline.warnings, "walls"))
    holds = None
    if (interval := outline.width_95_mm) is not None:
        holds = bool(interval[0] <= MM_PER_PX * branch.width_px.mean() <= interval[1])
    return Clicked(row, judged, "; ".join(texts(outline.warnings)), silent, walls, holds)


def run_unclicked(row: Listed, photos: Path) -> Unclicked:
    mask, branch = truth_of(row, photos)
    settings = _settings(photos / row.set / row.photo)
    search = CrackSearch.of(load_photo(settings, settings.file.parent))
    return Unclicked([is_hit(crack.line_px, branch, mask) for crack in search.cracks])


def truth_of(row: Listed, photos: Path) -> tuple[Mask, Branch]:
    height, width, _ = read_picture(_content(photos, row.set, row.photo, row.photo_sha256)).shape
    content = _content(photos, row.set, row.mask, row.mask_sha256)
    mask = read_mask(content, row.mask, read_sets()[row.set].least_value, (width, height))
    branch = Branch.of(mask)
    if abs(branch.length_px - row.branch_px) > 0.1:
        raise SystemExit(f"{row.photo}: the branch is {branch.length_px:.1f} px long, in the list {row.branch_px} px.")
    return mask, branch


def _content(photos: Path, one_set: str, path: str, sha256: str) -> bytes:
    file = photos / one_set / path
    if not file.exists() or digest(content := file.read_bytes()) != sha256:
        raise SystemExit(f"{file} is missing or not the listed file: see python -m benchmarks.real_roads_photos --help")
    return content


def photo_of(row: Listed, photos: Path) -> Photo:
    return load_photo(_settings(photos / row.set / row.photo), photos)


def _settings(file: Path, ends_px: tuple[tuple[float, float], tuple[float, float]] | None = None) -> PhotoInput:
    return PhotoInput(file=file.resolve(), data="measured", mm_per_px=MM_PER_PX, scale_is="assumed", ends_px=ends_px)
