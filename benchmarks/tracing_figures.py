"""How far a traced crack is from its exact truth."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from manifold3d import CrossSection, FillRule
from scipy.spatial import KDTree

from benchmarks.tracing_cases import Case
from digitise.crack_path.find_path import find_path
from digitise.outline import trace_outline
from digitise.photo import Photo, load_photo
from digitise.settings import PhotoInput
from fixtures.generate.fracture import mean_width_mm
from fixtures.generate.specimen import Specimen, make_specimen
from sealtwin.core.arc_length import arc_length
from sealtwin.core.errors import InputError
from sealtwin.core.records import Floats, Outline


@dataclass(frozen=True)
class Figures:
    """Distances from the truth; NaN in all but the time where the tool refused the photo."""

    centreline_mm: float
    """RMS distance of the traced centreline's points from the true one."""
    wall_mm: float
    """The same of both walls' points."""
    width_percent: float
    """Mean width, unsigned like the next two."""
    length_percent: float
    length_mm: float
    end_mm: float
    """The worse end's distance from the true one: a tip, or where the true centreline meets the edge of the face."""
    scale_percent: float
    """Of the face as a whole: spread of its mapped places over their true spread."""
    iou: float
    """Area that true and traced outline share over the area of both; with the side cracks, where they are kept."""
    time_s: float
    """Process time from the photo's file to its outline."""
    refusal: str = ""


def trace_case(case: Case, folder: Path) -> Figures:
    """Photograph the crack into ``folder``, trace it as a user would, and measure what comes out."""
    truth = make_specimen(case.seed, case.recipe)
    truth.write(folder)
    plain = truth.photo_input()
    settings = PhotoInput(
        file=plain.file,
        data=plain.data,
        markers=plain.markers,
        face_mm=plain.face_mm,
        ends_px=case.ends_px(truth),
        edge_fraction=case.edge_fraction,
        branches="keep" if case.keep_branches else "drop",
    )
    began = time.process_time()
    try:
        photo = load_photo(settings, folder)
        path = find_path(photo, settings.ends_px)
        outline = trace_outline(photo, path, settings)
    except InputError as refusal:
        nan = float("nan")
        return Figures(nan, nan, nan, nan, nan, nan, nan, nan, time.process_time() - began, str(refusal))
    return measured(outline, photo, truth, time.process_time() - began, case.keep_branches)


def measured(outline: Outline, photo: Photo, truth: Specimen, time_s: float, keep_branches: bool = False) -> Figures:
    length_mm = float(arc_length(truth.centreline_mm)[-1])
    width_mm = mean_width_mm(truth.centreline_mm, truth.width_mm)
    walls_mm = [
        distance_mm(outline.left_wall_mm, truth.left_wall_mm),
        distance_mm(outline.right_wall_mm, truth.right_wall_mm),
    ]
    return Figures(
        centreline_mm=_rms(distance_mm(outline.centreline_mm, truth.centreline_mm)),
        wall_mm=_rms(np.concatenate(walls_mm)),
        width_percent=100 * abs(outline.mean_width_mm / width_mm - 1),
        length_percent=100 * abs(outline.length_mm / length_mm - 1),
        length_mm=abs(outline.length_mm - length_mm),
        end_mm=float(np.linalg.norm(outline.centreline_mm[[0, -1]] - truth.centreline_mm[[0, -1]], axis=1).max()),
        scale_percent=100 * abs(_scale_error(photo, truth)),
        iou=_shared_area([outline.outline_mm], [truth.outline_mm, *(truth.branch_rings_mm if keep_branches else ())]),
        time_s=time_s,
    )


def distance_mm(points_mm: Floats, line_mm: Floats) -> Floats:
    """From each point to the nearest place on a polyline, (n,)."""
    s_mm = arc_length(line_mm)
    # So fine that the nearest point stands for the nearest place.
    fine_mm = np.append(np.arange(0, s_mm[-1], 0.002), s_mm[-1])
    return KDTree(np.column_stack([np.interp(fine_mm, s_mm, axis) for axis in line_mm.T])).query(points_mm)[0]


def _scale_error(photo: Photo, truth: Specimen) -> float:
    width, height = truth.recipe.face_mm
    face_mm = np.stack(np.meshgrid(np.linspace(0, width, 9), np.linspace(0, height, 5)), axis=-1).reshape(-1, 2)
    seen_mm = photo.to_mm(truth.to_px(face_mm))
    return _spread(seen_mm) / _spread(face_mm) - 1


def _spread(points: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum((points - points.mean(axis=0)) ** 2, axis=1))))


def _shared_area(one_mm: Sequence[Floats], other_mm: Sequence[Floats]) -> float:
    one, other = (CrossSection(list(rings), FillRule.Positive) for rings in (one_mm, other_mm))
    return (one ^ other).area() / (one + other).area()


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
