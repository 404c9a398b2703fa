"""Where the sample lies in front of the robot: a turn and a shift, fitted to points taught on its face."""

from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from sealtwin.errors import InputError
from sealtwin.records import Floats

THINNEST_MM = 5.0
"""Spread (RMS) of taught points square to their line. Below it a touch that is 0.2 mm too high tips the face by two
degrees and more."""
UNITS = {25.4: "inches", 10.0: "centimetres", 1000.0: "metres"}


@dataclass(frozen=True)
class Frame:
    """From the sample's millimetres to the robot's. Both right-handed; neither is stretched."""

    rotation: Floats  # (3, 3): its columns are the sample's axes as the robot sees them
    origin_mm: Floats  # (3,): the sample's origin, robot frame
    taught_mm: Floats  # (n, 2): the points it was fitted to, on the face
    residual_mm: Floats  # (n,): how far the robot's point lies from where the frame puts it
    scale: float
    """How much further apart the robot found the points than the sample says: 1 but for errors of touch."""

    @property
    def normal(self) -> Floats:
        """Out of the face, robot frame, (3,)."""
        return self.rotation[:, 2]

    def to_robot_mm(self, sample_mm: Floats) -> Floats:
        """Points (n, 3) of the sample's frame in the robot's."""
        return sample_mm @ self.rotation.T + self.origin_mm

    def error_growth(self, sample_mm: Floats) -> float:
        """What an error of touch becomes, square to the face, at the worst of points (n, 2 or 3) on it.

        The leverage sqrt(1 / n + x' S^-1 x) of a plane fitted to n points: below 1 among them, growing outside.
        """
        middle = self.taught_mm.mean(axis=0)
        spread, offset = self.taught_mm - middle, sample_mm[:, :2] - middle
        leverage = 1 / len(spread) + (offset @ np.linalg.inv(spread.T @ spread) * offset).sum(axis=1)
        return float(np.sqrt(leverage.max()))


def fit_frame(sample_mm: Floats, robot_mm: Floats, *, limit_mm: float, up: float, where: str) -> Frame:
    """Least squares over turns and shifts (Kabsch 1976): no scale, no mirror.

    Args:
        sample_mm: Points on the face, (n, 2), n at least 3.
        robot_mm: The same points as taught, (n, 3).
        limit_mm: The worst residual that is accepted.
        up: 1 where the robot's z points up, -1 where its base hangs from a ceiling.
        where: The file that a refusal names.

    Raises:
        InputError: the points lie on a line, are mirrored, of another scale, or do not fit within ``limit_mm``.
    """
    taught = np.column_stack([sample_mm, np.zeros(len(sample_mm))])
    _check_spread(sample_mm, where)
    rotation, origin_mm, scale = _kabsch(taught, robot_mm)
    residual_mm = np.linalg.norm(taught @ rotation.T + origin_mm - robot_mm, axis=1)
    if residual_mm.max() > limit_mm:
        _refuse(taught, robot_mm, rotation, scale, residual_mm, limit_mm, where)
    if up * rotation[2, 2] <= 0:
        raise InputError(
            f"{where}: the taught points are mirrored: they put the sample's face downward. Two of them are exchanged, "
            'or their y counts downward; it counts up as in outline.json. For an arm that hangs, set robot_z = "down".'
        )
    return Frame(rotation, origin_mm, sample_mm, residual_mm, scale)


def _kabsch(taught: Floats, robot_mm: Floats) -> tuple[Floats, Floats, float]:
    """Rotation, origin and the scale that would fit best."""
    middle, robot_middle = taught.mean(axis=0), robot_mm.mean(axis=0)
    spread, robot_spread = taught - middle, robot_mm - robot_middle
    left, singular, right = np.linalg.svd(spread.T @ robot_spread)
    handed = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    rotation = (left * handed @ right).T
    scale = float(singular @ handed / (spread**2).sum())
    return rotation, robot_middle - rotation @ middle, scale


def _check_spread(sample_mm: Floats, where: str) -> None:
    spread_mm = np.linalg.svd(sample_mm - sample_mm.mean(axis=0), compute_uv=False)[-1] / np.sqrt(len(sample_mm))
    if spread_mm < THINNEST_MM:
        raise InputError(
            f"{where}: the taught points lie within {spread_mm:.2g} mm of a line, which leaves open how the face is "
            f"tipped about it; they must spread by at least {THINNEST_MM:g} mm (RMS) to its sides. Teach a point far "
            "from the others, a corner of the face for one."
        )


def _refuse(
    taught: Floats,
    robot_mm: Floats,
    rotation: Floats,
    scale: float,
    residual_mm: Floats,
    limit_mm: float,
    where: str,
) -> NoReturn:
    scaled = scale * (taught - taught.mean(axis=0)) @ rotation.T + robot_mm.mean(axis=0)
    if np.linalg.norm(scaled - robot_mm, axis=1).max() <= limit_mm:
        raise InputError(
            f"{where}: the robot's points lie {scale:.4g} times as far apart as the sample's{_unit_hint(scale)}. Both "
            "are millimetres: check the numbers of [[taught]], or the scale of the photo."
        )
    worst = int(residual_mm.argmax())
    x, y = taught[worst, :2]
    raise InputError(
        f"{where}: the taught points do not fit a sample that is only turned and shifted: point {worst + 1}, "
        f"sample_mm = [{x:g}, {y:g}], lies {residual_mm[worst]:.2f} mm off; {limit_mm:g} mm are allowed "
        f"(frame_limit_mm). Scale of the points: {scale:.4f}. Touch them again, or check their order."
    )


def _unit_hint(scale: float) -> str:
    """The slip of units that a scale is within a twentieth of; empty where it is none."""
    for factor, unit in UNITS.items():
        for found, whose in ((1 / factor, "robot's"), (factor, "sample's")):
            if abs(scale / found - 1) < 0.05:
                return f", as if the {whose} were {unit}"
    return ""
