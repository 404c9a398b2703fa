"""The crack and the solid that was simulated, by their measures."""

from sealtwin.records import Sections, Solid
from validate.evidence import Evidence
from validate.statements.table import Table, millimetres
from validate.wording import counted, percent

WITHOUT_ANGLE = {"vertical": "vertical walls", "modelled": "as in the mesh"}


def geometry_table(evidence: Evidence) -> Table:
    outline, solid, report = evidence.outline, evidence.solid, evidence.solid.report
    rows = [
        ("length along the centreline", f"{outline.length_mm:.2f} mm"),
        ("ends", ", ".join(outline.ends)),
        (f"width in the {outline.seen_in}, mean", f"{outline.mean_width_mm:.2f} mm"),
        (
            "mean width of the mouth, of the floor",
            f"{millimetres(report.get('mouth_width_mm'))}, {millimetres(report.get('floor_width_mm'))}",
        ),
        ("depth", _depth_words(solid.sections)),
        ("tilt", tilt_words(evidence)),
        ("volume of the cavity", f"{solid.cavity_volume_mm3:.0f} mm³"),
    ]
    if "volume_mm3" in report:
        readings = ", ".join(f"{tilt} {volume:.0f}" for tilt, volume in report["volume_mm3"].items())
        rows.append((f"volume by reading of the tilt, {_angle_words(solid)}", f"{readings} mm³"))
    if solid.tilt == "funnel" and "closing_depth_mm" in report:
        closing = report["closing_depth_mm"]
        rows.append(
            (
                "walls meet at",
                f"{closing['mean']:.1f} mm deep, above the floor on {percent(closing['share_above_floor'], 0)}",
            )
        )
    if dams := report.get("dams"):
        high_mm = max(dam["box_mm"][5] for dam in dams)
        rows.append(
            (
                "in crack.stl beside the sample",
                f"{counted(len(dams), 'dam')} at open ends, to {high_mm:g} mm above the face: no part of the sample",
            )
        )
    rows.append(("cavity over sealant", f"{solid.cavity_volume_mm3 / evidence.run.dispensed_volume_mm3:.2f}"))
    return Table("Crack and solid", tuple(rows))


def tilt_words(evidence: Evidence) -> str:
    solid = evidence.solid
    if solid.tilt in WITHOUT_ANGLE:
        return WITHOUT_ANGLE[solid.tilt]
    return f"{solid.tilt}, {_angle_words(solid)} from vertical"


def _depth_words(sections: Sections) -> str:
    low_mm, high_mm = sections.depth_mm.min(), sections.depth_mm.max()
    return f"{high_mm:g} mm" if low_mm == high_mm else f"{low_mm:.3g} to {high_mm:.3g} mm, from station to station"


def _angle_words(solid: Solid) -> str:
    left_deg, right_deg = solid.wall_angles_deg
    return (
        f"each wall {left_deg:g}°" if left_deg == right_deg else f"left wall {left_deg:g}°, right wall {right_deg:g}°"
    )
