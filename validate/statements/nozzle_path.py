"""How the nozzle went: from where to where, how fast, how smooth."""

from typing import Any

from sealtwin.records import Floats, Trajectory, arc_length
from validate.evidence import Evidence
from validate.statements.table import Table
from validate.wording import counted


def path_table(evidence: Evidence) -> Table:
    trajectory = evidence.trajectory
    giving = trajectory.giving
    begins_mm, ends_mm = trajectory.s_mm[giving][[0, -1]]
    rows = [
        ("gives sealant from, to", f"s = {begins_mm:.1f} to {ends_mm:.1f} mm"),
        ("duration", f"{trajectory.duration_s:.2f} s in {counted(len(trajectory.t_s), 'waypoint')}"),
        ("speed", _span(trajectory.speed_mm_s[:-1], 2, "mm/s")),
        ("flow", _span(trajectory.flow_mm3_s[giving.start : giving.stop - 1], 1, "mm³/s")),
        ("height above the face", f"{trajectory.position_mm[:, 2].mean():.1f} mm"),
    ]
    if (path := evidence.solid.report.get("path")) is not None:
        rows.insert(1, ("length over the crack", _smoothed(path)))
    leads_mm = [arc_length(points)[-1] for points in _leads(trajectory)]
    if any(leads_mm):
        rows.append(("without sealant before, after", f"{leads_mm[0]:.1f} mm, {leads_mm[1]:.1f} mm"))
    return Table("Nozzle path", tuple(rows))


def _smoothed(path: dict[str, Any]) -> str:
    """A length means little without how much was smoothed away."""
    radius_mm = path["smallest_radius_mm"]
    bends = "" if radius_mm is None else f", smallest radius {radius_mm:.1f} mm"
    return (
        f"{path['length_mm']:.2f} mm, smoothed within {path['smoothing_mm']:g} mm RMS of the centreline's "
        f"{path['centreline_mm']:.2f} mm; turns by up to {path['largest_turn_deg']:.1f}°{bends}"
    )


def _leads(trajectory: Trajectory) -> tuple[Floats, Floats]:
    giving = trajectory.giving
    return trajectory.position_mm[: giving.start + 1], trajectory.position_mm[giving.stop - 1 :]


def _span(values: Floats, decimals: int, unit: str) -> str:
    """One number where they are the same as far as it is written, else the least and the most."""
    least, most = (f"{value:.{decimals}f}" for value in (values.min(), values.max()))
    return f"{least} {unit}" if least == most else f"{least} to {most} {unit}"
