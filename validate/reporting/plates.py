"""The figures of a report, each with its caption and its room on a page."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from matplotlib.figure import FigureBase

from validate.drawing.level_curves import draw_error, draw_histogram, draw_profile
from validate.drawing.pictures import draw_sections, draw_side_view, draw_solid, draw_top_view, view_solid
from validate.drawing.snapshots import Scene, draw_fill, fill_height_in
from validate.evidence import Evidence


@dataclass(frozen=True)
class Plate:
    caption: str
    height_in: float
    """On a page that is A4 wide."""
    draw: Callable[[FigureBase | None], FigureBase]


def level_plates(evidence: Evidence) -> list[Plate]:
    """Those of the comparison only where there is one."""
    profile, readings, comparison = evidence.profile, evidence.readings, evidence.comparison
    against = "" if readings is None else ", with the caliper's means, their 95 % band and the single readings"
    plates = [
        Plate(
            f"Simulated level along the crack{against}.",
            3.4,
            lambda on: draw_profile(profile, evidence.solid.sections, readings, comparison, on),
        )
    ]
    if readings is None or comparison is None:
        return plates
    return [
        *plates,
        Plate(
            "Signed error along the crack. Inside the band, the readings cannot tell the two apart.",
            2.75,
            lambda on: draw_error(profile, readings, comparison, on),
        ),
        Plate(
            "Mean absolute error in each 10 mm of the crack's length, exact integrals, as in the paper's Fig. 9b.",
            2.75,
            lambda on: draw_histogram(comparison, on),
        ),
    ]


def fill_plates(evidence: Evidence) -> list[Plate]:
    """Over time where the run left snapshots, then at rest."""
    outline, solid, run = evidence.outline, evidence.solid, evidence.run
    plates = []
    if evidence.frames:
        scene = Scene(outline, solid, evidence.trajectory, run.radius_mm, run.settings["nozzle"]["diameter_mm"])
        plates.append(
            Plate(
                "Sections along the crack as it is filled, particles coloured by speed on the left and by age on the "
                "right, as in the paper's Fig. 6. The particles nearest to the centreline lie on top.",
                fill_height_in(evidence.frames),
                lambda on: draw_fill(evidence.frames, scene, on),
            )
        )
    return [
        *plates,
        Plate(
            "Every particle at its place along the crack, coloured by age; the line is the profile read from them.",
            2.75,
            lambda on: draw_side_view(run, outline, solid, evidence.profile, on),
        ),
        Plate(
            "The sample from above, particles coloured by height.",
            2.8,
            lambda on: draw_top_view(run, outline, solid, evidence.trajectory, on),
        ),
        Plate(
            "Across the crack, seen along the nozzle's path: the solid, cut, and the particles of a slice one diameter "
            "thick, coloured by age.",
            2.6,
            lambda on: draw_sections(run, outline, solid, on),
        ),
    ]


def solid_plate(evidence: Evidence) -> Plate:
    solid = evidence.solid
    views = cache(lambda: view_solid(solid))
    dams = ", with the dams at its open ends" if solid.report.get("dams") else ""
    return Plate(
        f"The solid that was simulated, as it stands in crack.stl{dams}, and its cavity alone.",
        3.5,
        lambda on: draw_solid(solid, views(), on),
    )
