"""The list of real photos and of bare ground, drawn by rule and committed before tracing was judged on it.

    python -m benchmarks.real_roads_list CLONES [--sheets FOLDER]

Photos: of each set those whose branch (see real_roads_rules) is at least 0.12 of the photo's diagonal from end to end,
in name order; of n of these the first of every max(1, round(n / 25)). Clicks: the ends of the branch, each moved by
N(0, 3 px) along x and y with a seed by set and row, kept inside the photo.

Crops: of each listed photo 400 boxes are drawn with a seed, sides 0.35 to 0.75 of the photo's shorter side and at least
80 px; the largest one is taken whose margin of 10 px has no mask. Of each photo of CrackForest that has no mask, the
first four boxes that do not overlap are taken. What is in a crop was named by looking at the contact sheets; a crop
with a crack that no mask has is called "crack" and not judged. A kind is kept when the list is drawn again.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from typer import Option

from benchmarks.real_roads_photos import (
    BARE,
    PHOTOS,
    Clone,
    Crop,
    Listed,
    Mask,
    Set,
    crops,
    digest,
    read_mask,
    read_picture,
    read_sets,
    write_rows,
)
from benchmarks.real_roads_rules import Branch
from benchmarks.table import run_benchmark

ABOUT = 25
LEAST_OF_DIAGONAL = 0.12
CLICK_SD_PX = 3.0
SEED = 51
DRAWS = 400
SIDES, LEAST_SIDE_PX = (0.35, 0.75), 80
MARGIN_PX = 10
EACH_WITHOUT = 4
ACROSS, TILE_PX = 8, 200


def main(
    clones: Path, sheets: Annotated[Path | None, Option(help="folder for contact sheets of the crops")] = None
) -> None:
    kinds = {_place(crop): crop.kind for crop in crops()}
    rows, bare = list[Listed](), list[Crop]()
    for number, one in enumerate(read_sets().values()):
        clone = Clone(one, clones)
        for row, (photo, pixels, mask) in enumerate(_chosen(clone)):
            rows.append(_clicked(clone, photo, pixels, mask, np.random.default_rng([SEED, number, row])))
            bare += _largest_bare(clone, photo, mask, np.random.default_rng([SEED, number, row, 1]))
        if one.name == "cfd":
            bare += _without_mask(clone, number)
    bare = [Crop(**{**vars(crop), "kind": kinds.get(_place(crop), "")}) for crop in bare]
    write_rows(PHOTOS, rows)
    write_rows(BARE, bare)
    for one in read_sets().values():
        counts = [sum(row.set == one.name for row in some) for some in (rows, bare)]
        print(f"{one.name}: {counts[0]} photos, {counts[1]} crops")
    if sheets is not None:
        _draw_sheets(clones, bare, sheets)


def _photos(one: Set, clone: Clone) -> list[str]:
    """Return the set's photos in the order of their names, whatever folder they are in."""
    patterns = [pattern.partition("{name}") for pattern in one.photos]
    mine = [name for name in clone.names if any(name.startswith(a) and name.endswith(b) for a, _, b in patterns)]
    return sorted(mine, key=lambda path: Path(path).name)


def _chosen(clone: Clone) -> list[tuple[str, NDArray[np.uint8], Mask]]:
    fit = []
    for photo in _photos(clone.of, clone):
        if clone.of.mask_of(photo) not in clone.names:
            continue
        pixels = read_picture(clone.read(photo))
        mask = _mask(clone, photo, pixels)
        ends = Branch.of(mask).line_px[[0, -1]] if mask.any() else np.zeros((2, 2))
        if np.linalg.norm(ends[1] - ends[0]) >= LEAST_OF_DIAGONAL * np.hypot(*mask.shape):
            fit.append((photo, pixels, mask))
    return fit[:: max(1, round(len(fit) / ABOUT))]


def _mask(clone: Clone, photo: str, pixels: NDArray[np.uint8]) -> Mask:
    path = clone.of.mask_of(photo)
    return read_mask(clone.read(path), path, clone.of.least_value, (pixels.shape[1], pixels.shape[0]))


def _clicked(clone: Clone, photo: str, pixels: NDArray[np.uint8], mask: Mask, rng: np.random.Generator) -> Listed:
    branch, path = Branch.of(mask), clone.of.mask_of(photo)
    clicks = branch.line_px[[0, -1]] + CLICK_SD_PX * rng.standard_normal((2, 2))
    clicks = np.clip(clicks, 0, [pixels.shape[1] - 1, pixels.shape[0] - 1]).round(1)
    (first_x, first_y), (last_x, last_y) = clicks.tolist()
    return Listed(
        clone.of.name,
        photo,
        path,
        first_x,
        first_y,
        last_x,
        last_y,
        branch_px=round(branch.length_px, 1),
        photo_sha256=digest(clone.read(photo)),
        mask_sha256=digest(clone.read(path)),
    )


def _largest_bare(clone: Clone, photo: str, mask: Mask, rng: np.random.Generator) -> list[Crop]:
    wide = cv2.dilate(mask.astype(np.uint8), np.ones((2 * MARGIN_PX + 1,) * 2))
    boxes = [
        box for box in _boxes(rng, (mask.shape[1], mask.shape[0])) if not wide[box[1] : box[3], box[0] : box[2]].any()
    ]
    largest = sorted(boxes, key=lambda box: -(box[2] - box[0]) * (box[3] - box[1]))[:1]
    return [Crop(clone.of.name, photo, *box, "", digest(clone.read(photo))) for box in largest]


def _without_mask(clone: Clone, number: int) -> Iterator[Crop]:
    alone = [photo for photo in _photos(clone.of, clone) if clone.of.mask_of(photo) not in clone.names]
    for row, photo in enumerate(alone):
        content = clone.read(photo)
        height, width = read_picture(content).shape[:2]
        taken = list[tuple[int, int, int, int]]()
        for box in _boxes(np.random.default_rng([SEED, number, row, 2]), (width, height)):
            if len(taken) < EACH_WITHOUT and not any(_overlap(box, other) for other in taken):
                taken.append(box)
        for box in taken:
            yield Crop(clone.of.name, photo, *box, "", digest(content))


def _boxes(rng: np.random.Generator, size_px: tuple[int, int]) -> Iterator[tuple[int, int, int, int]]:
    for _ in range(DRAWS):
        sides = np.maximum(LEAST_SIDE_PX, rng.uniform(*SIDES, 2) * min(size_px)).astype(int)
        left, top = (rng.random(2) * (np.array(size_px) - sides + 1)).astype(int)
        yield int(left), int(top), int(left + sides[0]), int(top + sides[1])


def _overlap(a: tuple[int, int, int, int], b: tuple[int, int, int, int]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _place(crop: Crop) -> tuple[str, str, int, int, int, int]:
    return crop.set, crop.photo, crop.left_px, crop.top_px, crop.right_px, crop.bottom_px


def _draw_sheets(clones: Path, bare: list[Crop], folder: Path) -> None:
    """Draw the crops in rows of eight with their line in the list, 48 to a sheet."""
    folder.mkdir(parents=True, exist_ok=True)
    sets, each = read_sets(), 6 * ACROSS
    for first in range(0, len(bare), each):
        sheet = np.full((6 * (TILE_PX + 20), ACROSS * TILE_PX, 3), 255, dtype=np.uint8)
        for at, crop in enumerate(bare[first : first + each]):
            piece = crop.of(read_picture(Clone(sets[crop.set], clones).read(crop.photo)))
            share = (TILE_PX - 6) / max(piece.shape[:2])
            piece = cv2.resize(piece, None, fx=share, fy=share, interpolation=cv2.INTER_CUBIC)
            top, left = at // ACROSS * (TILE_PX + 20), at % ACROSS * TILE_PX
            sheet[top + 18 : top + 18 + piece.shape[0], left : left + piece.shape[1]] = piece
            words = f"{first + at + 2} {crop.set} {crop.kind}"
            cv2.putText(sheet, words, (left + 2, top + 13), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 1, cv2.LINE_AA)
        Image.fromarray(sheet).save(folder / f"crops-{first // each + 1}.png")


if __name__ == "__main__":
    run_benchmark(main)
