"""Make the routes on which the verdict on a line is fitted, from the listed real photos.

    python -m benchmarks.line_verdict_routes PHOTOS [--jobs 2]

Writes benchmarks/real_roads/routes.csv. Each photo gives routes between its true clicks, and wrong routes made on
purpose: clicks moved by 10 to 40 px, ends on two cracks, ends on a joint, both ends on bare ground (twice), and the
true clicks in the photo's negative, where the crack is light. In ``shade`` rows a light band is painted along the
crack, of which the crack is then the shade; they check ``LIGHT`` and are not part of the fit. Routes that the search
itself refuses are left out. ``found`` rows are the lines that are offered without clicks.
"""

import csv
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from skimage.measure import label

from benchmarks.real_roads_photos import FOLDER, Listed, Mask, listed
from benchmarks.real_roads_rules import Branch, verdict
from benchmarks.real_roads_runs import photo_of, truth_of
from benchmarks.table import run_benchmark
from digitise.crack_path.candidates import candidates
from digitise.crack_path.find_path import CrackSearch, LiveWire
from digitise.crack_path.hints import check_hints
from digitise.crack_path.line_verdict import WEIGHTS, judge
from digitise.crack_path.medial_axis import longest_line
from digitise.geometry.polyline import left_normals, smoothed
from digitise.image.raster import DISPLAY_GAMMA
from digitise.photo import Photo
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats

ROUTES = FOLDER / "routes.csv"
SEED = 96
MOVED_PX = 10.0, 40.0
OFF_CRACK_PX, GROUND_SHARE = 25.0, 0.3
"""Least distance of bare ground from a crack, and of both ends there from each other over the photo's longer side."""
MIN_PIECE = 60
ON_CRACK = 0.1
"""A joint has at most this share on the mask."""
COLUMNS = ("set", "photo", "kind", "verdict", "score", "unlike", *WEIGHTS)


def main(photos: Path, jobs: int = 2) -> None:
    with ProcessPoolExecutor(jobs, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        made = [row for rows in pool.map(partial(routes_of, photos=photos), listed()) for row in rows]
    with ROUTES.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(made)
    print(f"{len(made)} routes in {ROUTES}")


def routes_of(row: Listed, photos: Path) -> list[dict[str, object]]:
    mask, branch = truth_of(row, photos)
    photo = photo_of(row, photos)
    wire, rows = LiveWire(photo), []
    for kind, ends_px, live in _made(row, photo, wire, mask, branch):
        try:
            check_hints(photo, ends_px)
            route = live.route(np.array(ends_px), clicked=True)
        except InputError:
            continue
        wrong = kind in ("negative", "shade") or verdict(route.points_px, branch, mask) == "wrong"
        answer = "wrong" if wrong else verdict(route.points_px, branch, mask)
        rows.append(_row(row, kind, answer, judge(route).inputs))
    search = CrackSearch.of(photo)
    for number, crack in enumerate(search.cracks, 1):
        try:
            path = search.path(number)
        except InputError:
            continue
        inputs = {name: path.verdict[name] for name in WEIGHTS}
        answer = verdict(path.points_px, branch, mask)
        rows.append(
            _row(row, f"found {number}", answer, inputs)
            | {"score": f"{crack.score / search.cracks[0].score:.3g}", "unlike": f"{crack.unlike:.3g}"}
        )
    return rows


def _row(row: Listed, kind: str, answer: str, inputs: dict[str, float]) -> dict[str, object]:
    figures = {name: f"{value:.4f}" for name, value in inputs.items()}
    return {"set": row.set, "photo": Path(row.photo).name, "kind": kind, "verdict": answer, **figures}


Ends = tuple[tuple[float, float], tuple[float, float]]


def _made(
    row: Listed, photo: Photo, wire: LiveWire, mask: Mask, branch: Branch
) -> Iterator[tuple[str, Ends, LiveWire]]:
    rng = np.random.default_rng([SEED, int(row.photo_sha256[:8], 16)])
    most_px = np.array(photo.size_px) - 2.0

    def inside(points_px: Floats) -> Ends:
        (a, b), (c, d) = np.clip(points_px, 1, most_px).tolist()
        return (a, b), (c, d)

    true_px = np.array(row.ends_px)
    yield "true", row.ends_px, wire
    for _ in range(2):
        way = rng.uniform(0, 2 * np.pi, 2)
        yield (
            "moved",
            inside(true_px + rng.uniform(*MOVED_PX, (2, 1)) * np.column_stack([np.cos(way), np.sin(way)])),
            wire,
        )
    pieces = np.asarray(label(mask, connectivity=2))
    area = np.bincount(pieces.ravel())[1:]
    largest = [number + 1 for number in np.argsort(-area, kind="stable")[:2] if area[number] >= MIN_PIECE]
    if len(largest) == 2:
        first, second = (longest_line(pieces == number)[:, ::-1].astype(float) for number in largest)
        yield "two cracks", inside(np.array([first[0], second[-1]])), wire
    ground = np.argwhere(cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 5) > OFF_CRACK_PX)[:, ::-1]
    for _ in range(2 if len(ground) else 0):
        pairs = ground[rng.integers(0, len(ground), (20, 2))].astype(float)
        far = np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1) > GROUND_SHARE * max(photo.size_px)
        if far.any():
            yield "ground", inside(pairs[int(np.argmax(far))]), wire
    for joint in candidates(photo, wire.field)[1][:1]:
        column, line = np.clip(np.rint(np.linspace(joint[0], joint[1], 50)), 0, most_px).astype(int).T
        if mask[line, column].mean() <= ON_CRACK:
            yield "joint", inside(joint), wire
    yield "negative", row.ends_px, LiveWire(_negative(photo))
    yield "shade", row.ends_px, LiveWire(_with_band(photo, branch, rng))


def _negative(photo: Photo) -> Photo:
    """The photo with each displayed brightness replaced by its complement."""
    shown = 1 - np.power(photo.brightness, 1 / DISPLAY_GAMMA)
    return replace(photo, brightness=np.power(shown, DISPLAY_GAMMA).astype(np.float32))


def _with_band(photo: Photo, branch: Branch, rng: np.random.Generator) -> Photo:
    """The photo with a light band along one side of the branch: 3 to 12 px wide, 1.2 to 2 times as bright."""
    wide_px, times, side = rng.uniform(3, 12), rng.uniform(1.2, 2), rng.choice([-1, 1])
    line_px = smoothed(branch.line_px, 4.0)
    aside_px = side * (np.median(branch.width_px) / 2 + wide_px / 2 + 1)
    band, middle_px = np.zeros(photo.brightness.shape, np.float32), line_px + aside_px * left_normals(line_px)
    cv2.polylines(band, [np.rint(middle_px).astype(np.int32)], False, [1.0], max(1, round(wide_px)), cv2.LINE_AA)
    band = cv2.GaussianBlur(band, (0, 0), 0.7)
    return replace(photo, brightness=np.asarray(photo.brightness * (1 + (times - 1) * band), np.float32))


if __name__ == "__main__":
    run_benchmark(main)
