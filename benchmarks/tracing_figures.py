"""How far a traced crack is from its exact truth."""

from dataclasses import dataclass
from math import nan
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from benchmarks.table import rms
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
    """Distances from the truth; NaN if the photo was refused."""

    centreline_mm: float = nan
    """RMS distance of the traced centreline's points from the true one."""
    wall_mm: float = nan
    """The same of both walls' points."""
    width_percent: float = nan
    """Mean width, unsigned like all that follow."""
    length_percent: float = nan
    length_mm: float = nan
    scale_percent: float = nan
    """Of the face as a whole: spread of its mapped places over their true spread."""
    refusal: str = ""

    @property
    def summary(self) -> str:
        if self.refusal:
            return self.refusal
        lines = f"centreline {self.centreline_mm:.3f} mm, walls {self.wall_mm:.3f} mm"
        return f"{lines}, width {self.width_percent:.2f} %, length {self.length_percent:.2f} %"


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
    )
    try:
        photo = load_photo(settings, folder)
        outline = trace_outline(photo, find_path(photo, settings.ends_px), settings)
    except InputError as refusal:
        return Figures(refusal=str(refusal))
    return measured(outline, photo, truth)


def measured(outline: Outline, photo: Photo, truth: Specimen) -> Figures:
    length_mm = float(arc_length(truth.centreline_mm)[-1])
    width_mm = mean_width_mm(truth.centreline_mm, truth.width_mm)
    walls_mm = (outline.left_wall_mm, truth.left_wall_mm), (outline.right_wall_mm, truth.right_wall_mm)
    return Figures(
        centreline_mm=rms(distance_mm(outline.centreline_mm, truth.centreline_mm)),
        wall_mm=rms(np.concatenate([distance_mm(traced_mm, true_mm) for traced_mm, true_mm in walls_mm])),
        width_percent=100 * abs(outline.mean_width_mm / width_mm - 1),
        length_percent=100 * abs(outline.length_mm / length_mm - 1),
        length_mm=abs(outline.length_mm - length_mm),
        scale_percent=100 * abs(_scale_error(photo, truth)),
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
    return rms(np.linalg.norm(points - points.mean(axis=0), axis=1))
