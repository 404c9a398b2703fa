"""The photos and masks of the real-road list, copied out of clones of the public repositories.

    git clone https://github.com/OWNER/NAME CLONES/NAME      (each repository of benchmarks/real_roads/sets.toml)
    python -m benchmarks.real_roads_photos CLONES PHOTOS

Copies each listed file to PHOTOS/SET/PATH-IN-REPOSITORY and compares its SHA-256 with the list. The files remain under
their authors' licences and are not distributed here.
"""

import csv
import hashlib
import re
import subprocess
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import get_type_hints

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.io import loadmat

from benchmarks.table import run_benchmark

FOLDER = Path(__file__).parent / "real_roads"
SETS, PHOTOS = FOLDER / "sets.toml", FOLDER / "photos.csv"

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Set:
    """One public set: where its photos and masks are."""

    name: str
    title: str
    repository: str
    commit: str
    photos: Sequence[str]
    masks: Sequence[str]
    least_value: int
    target_percent: float

    def mask_of(self, photo: str) -> str:
        """Return the path of a photo's mask in the repository."""
        for ours, theirs in zip(self.photos, self.masks, strict=True):
            if match := re.fullmatch(re.escape(ours).replace(r"\{name\}", "([^/]+)"), photo):
                return theirs.format(name=match[1])
        raise ValueError(f"{self.name} has no photo {photo}")


@dataclass(frozen=True)
class Listed:
    """One photo of the list, and where it is clicked."""

    set: str
    photo: str
    mask: str
    first_x_px: float
    first_y_px: float
    last_x_px: float
    last_y_px: float
    branch_px: float
    """Length of the branch between whose ends the clicks are."""
    photo_sha256: str
    mask_sha256: str

    @property
    def ends_px(self) -> tuple[tuple[float, float], tuple[float, float]]:
        return (self.first_x_px, self.first_y_px), (self.last_x_px, self.last_y_px)


def main(clones: Path, photos: Path) -> None:
    wanted = {(row.set, row.photo): row.photo_sha256 for row in listed()}
    wanted |= {(row.set, row.mask): row.mask_sha256 for row in listed()}
    sets = read_sets()
    for (name, path), sha256 in wanted.items():
        repository, commit = sets[name].repository, sets[name].commit
        show = ["git", "-C", str(clones / repository.partition("/")[2]), "show", f"{commit}:{path}"]
        content = subprocess.run(show, check=True, capture_output=True).stdout
        if digest(content) != sha256:
            raise SystemExit(f"{repository}: {path} is not the file of the list: its SHA-256 differs.")
        target = photos / name / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    print(f"{len(wanted)} files of {len(sets)} sets in {photos}")


def read_sets() -> dict[str, Set]:
    content = tomllib.loads(SETS.read_text(encoding="utf-8"))
    return {name: Set(name, **facts) for name, facts in content.items()}


def listed() -> list[Listed]:
    with PHOTOS.open(newline="", encoding="utf-8") as file:
        types = get_type_hints(Listed)
        return [Listed(**{name: types[name](text) for name, text in row.items()}) for row in csv.DictReader(file)]


def digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def read_mask(content: bytes, path: str, least_value: int, size_px: tuple[int, int]) -> Mask:
    """Return where a mask has crack. A mask of another size than the photo is enlarged to its nearest pixels."""
    if path.endswith(".mat"):
        values = loadmat(BytesIO(content))["groundTruth"]["Segmentation"][0, 0]
    else:
        with Image.open(BytesIO(content)) as picture:
            values = np.asarray(picture.convert("RGB").convert("L"))
    mask = (values >= least_value).astype(np.uint8)
    return cv2.resize(mask, size_px, interpolation=cv2.INTER_NEAREST_EXACT).astype(bool)


def read_picture(content: bytes) -> NDArray[np.uint8]:
    """Return red, green and blue of a photo."""
    with Image.open(BytesIO(content)) as picture:
        return np.asarray(picture.convert("RGB"))


if __name__ == "__main__":
    run_benchmark(main)
