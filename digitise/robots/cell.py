"""Read a robot's cell file, in TOML: limits, languages, the sample's frame from taught points, and a weighed pump.

The weighings determine which flow to request from the pump so that it delivers the flow of a path.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeVar

import numpy as np
from pydantic import Field, create_model
from scipy.spatial.transform import Rotation
from scipy.special import stdtrit

from digitise.robots.programs import CSV, GCODE, URSCRIPT, InCell, LanguageSettings
from digitise.robots.spel import SPEL
from digitise.settings import OnFace
from sealtwin.core.arrays import Floats, lengths
from sealtwin.core.errors import InputError, present
from sealtwin.core.plain_files import read_columns
from sealtwin.core.settings import Settings

LANGUAGES = {language.name: language for language in (CSV, SPEL, GCODE, URSCRIPT)}
"""All languages by name. Cell files, --format, plans and reports read this table."""
if TYPE_CHECKING:
    Format = str
    LanguageTables = Settings
else:
    Format = Literal[tuple(LANGUAGES)]
    # A table for each language that has settings, under the language's name.
    LanguageTables = create_model(
        "LanguageTables",
        __base__=Settings,
        **{name: (language.settings | None, None) for name, language in LANGUAGES.items() if language.settings},
    )
Table = TypeVar("Table", bound=LanguageSettings)
# Minimum RMS distance of the taught points from a line. Below it, an error of 0.2 mm would tilt the face by over 2°
THINNEST_MM = 5.0
# Limits of the weighings of a pump.
BOUNDS = {
    "asked_mm3_s": (1e-3, 1e6),
    "weighed_g": (1e-4, 1e5),
    "time_s": (0.1, 1e5),
    "delay_s": (0.0, 30.0),
}
NEEDED = ("asked_mm3_s", "weighed_g", "time_s")
ROWS = (4, 500)
MISTYPED = 5.0  # If delivered and requested flow differ by this factor, a unit is wrong
DOUBTFUL = 0.1  # A larger relative half-width of a flow's interval gives a warning, as for all measured values
ROUNDING = 1e-9  # Largest relative scatter of weighings that count as equal
TOLERANCE = 1e-6  # Largest relative difference of two numbers that count as equal
NO_SCATTER = (
    "weighings of the same flow agree to the last digit and show no scatter, so the uncertainty of the path's flow "
    "is unknown. Weigh for longer or on a finer scale"
)
SCATTERS = (
    "weighings of the same flow scatter by {:.0%} (standard deviation), so the path's flow is known only to {:.0%} "
    "(95 %). Weigh more often or for longer"
)


class Taught(Settings):
    """A point on the face, in the sample's frame and in the robot's frame."""

    sample_mm: tuple[OnFace, OnFace]
    """x and y as in outline.json: x to the right and y up in the photo. [0, 0] is the lower left corner of the face,
    or of the area inside the frame of markers."""
    robot_mm: tuple[InCell, InCell, InCell]
    """Coordinates that the pendant shows while the nozzle's tip is on that point."""


class Reach(Settings):
    """Box in the robot's frame that the nozzle's tip must not leave."""

    low_mm: tuple[InCell, InCell, InCell]
    """Smallest x, y and z of the box."""
    high_mm: tuple[InCell, InCell, InCell]
    """Largest x, y and z of the box."""


class Motion(Settings):
    """Limits of the arm's motion."""

    largest_speed_mm_s: float = Field(gt=0.01, le=5000)
    """Largest speed of the tip. Required, since it depends on the cell."""
    acceleration_mm_s2: float = Field(gt=1, le=50_000)
    """Acceleration of the tip in programs, and the limit for ramps and bends of the path."""
    approach_speed_mm_s: float = Field(default=20.0, gt=0.1, le=250)
    """Speed to the path and away from it. At 20 mm/s the nozzle needs 2.5 s for 50 mm, long enough to press the stop.
    The maximum of 250 is the limit of manual operation in ISO 10218-1."""
    safe_height_mm: float = Field(default=50.0, gt=1, le=1000)
    """Height of the tip above the face before and after the path. The default is five times the height of the dams at
    open ends."""
    largest_tilt_deg: float = Field(default=5.0, gt=0, le=30)
    """Largest angle between the nozzle and the face's normal. At 5 degrees, from 3 mm above the face, the jet meets the
    face 0.26 mm off the path."""


class Plunger(Settings):
    """A syringe whose plunger the robot drives, by one of its axes or as an extruder."""

    diameter_mm: float = Field(gt=0.5, le=300)
    """Inner diameter of the syringe. For a geared plunger, the diameter of a syringe that would give as much sealant
    for each millimetre of the axis. To find it, weigh the sealant that the axis gives over 10 mm."""
    travel_mm: float = Field(gt=0.1, le=1000)
    """Remaining travel of the plunger. A path that needs more is refused."""
    largest_speed_mm_s: float = Field(gt=0.001, le=500)
    """Largest speed of the plunger."""

    @property
    def area_mm2(self) -> float:
        """Volume of sealant, in mm³, for each millimetre of the axis."""
        return np.pi / 4 * self.diameter_mm**2


class Pump(Settings):
    """File with the weighings of a pump, and the density of the weighed sealant."""

    file: Path
    """CSV with the columns asked_mm3_s, weighed_g, time_s and, if it was timed, delay_s. The path is absolute or
    relative to the cell file. asked_mm3_s is the requested flow. weighed_g is the mass of sealant that a cup caught
    during time_s, in steady flow. delay_s is the time from the request to the first sealant. Give two or more weighings
    of each of two or more flows."""
    density_kg_m3: float = Field(ge=100, le=2e4)
    """Density of the sealant."""
    density_error_kg_m3: float = Field(default=0.0, ge=0, le=2e4)
    """Standard uncertainty of the density. It changes all flows by the same factor."""


class RobotCell(LanguageTables):
    """Content of a robot's cell file: limits of the cell, taught points, pump, and a table for each language."""

    name: Annotated[str, Field(min_length=1, max_length=80)]
    """Name of the cell. It is written at the head of the cell's programs."""
    formats: tuple[Format, ...] = Field(min_length=1)
    """Formats to write if --format is not given."""
    frame_limit_mm: float = Field(default=0.5, gt=0, le=10)
    """Largest allowed distance of a taught point from its fitted position. The default is a sixth of the width of the
    paper's crack, 3.1 mm, and more than the error of touching a mark by hand."""
    taught_in: Literal["sample", "photo"] = "sample"
    """Frame of the taught points. sample: [0, 0] is on the sample, as markers or the face's corners define it. photo:
    [0, 0] is the lower left pixel of this photo, and the sample has not been moved since. A crack whose scale is a
    ruler or mm_per_px has only the second frame."""
    taught: tuple[Taught, ...] = Field(min_length=3, max_length=100)
    """Three or more points on the face, not all on one line. With four or more, teaching errors are detected better."""
    reach: Reach
    motion: Motion
    plunger: Plunger | None = None
    pump: Pump | None = None
    """Weighings of the pump. If they are given, programs request the flow at which the pump delivers the flow of the
    path. Default: the pump delivers the flow that is requested."""

    @property
    def languages(self) -> dict[str, LanguageSettings]:
        """Settings of each language that has a table in the cell file, by the language's name."""
        return {name: table for name in LANGUAGES if (table := getattr(self, name, None)) is not None}

    def table(self, kind: type[Table]) -> Table:
        """Return the settings of the class ``kind``. Raises ValueError if the cell file has no such table."""
        return present(
            next((table for table in self.languages.values() if isinstance(table, kind)), None), kind.__name__
        )

    @property
    def steady_settings(self) -> list[str]:
        """Settings, as written in the file, with which a program can have only one speed or one flow."""
        tables = {name: table for name, table in self.languages.items() if name in self.formats}
        return [f"{name}.{setting}" for name, table in tables.items() for setting in table.steady]

    @property
    def flow_limits_mm3_s(self) -> list[float]:
        """Largest flows that the plunger and the languages allow, in mm³/s. Languages without a limit are left out."""
        flows = [table.largest_flow_mm3_s for table in self.languages.values()]
        flows += [] if self.plunger is None else [self.plunger.area_mm2 * self.plunger.largest_speed_mm_s]
        return [flow for flow in flows if flow is not None]

    def require_frame(self, has_origin: bool, where: str) -> None:
        """Raise InputError, with ``where`` first, if the points were taught in another frame than a crack has.

        ``has_origin`` is False if the crack's [0, 0] is only the photo's corner.
        """
        frame = "sample" if has_origin else "photo"
        if self.taught_in != frame:
            raise InputError(
                f"{where}: taught_in is {self.taught_in}, but the crack's [0, 0] is on the {frame}. Digitise with "
                "markers or the face's corners, and teach points on the sample. A ruler or mm_per_px alone requires "
                'points that were taught in this photo, and taught_in = "photo" at the top of the cell file.'
            )

    def missing_for(self, kind: Format) -> str | None:
        """Return the name of the table that a format needs and the cell lacks. None if no table is missing."""
        table = self.languages.get(kind)
        if table is None:
            return kind if LANGUAGES[kind].settings else None
        return "plunger" if table.presses_plunger and self.plunger is None else None

    def _check(self) -> None:
        for kind in self.formats:
            if (table := self.missing_for(kind)) is not None:
                raise ValueError(
                    f'formats has "{kind}", but there is no [{table}] table. Add that table, or remove "{kind}"'
                )


class ProgramOptions(Settings):
    """Choice of programs to write: options of 'sealtwin robot', and keywords of ``write_robot_program``."""

    formats: tuple[Format, ...] = ()
    """Formats to write. Default: the cell's formats."""


@dataclass(frozen=True)
class RobotFrame:
    """Rigid transform from the sample's frame to the robot's, in mm. Both frames are right-handed."""

    rotation: Floats  # (3, 3). The columns are the sample's axes in the robot's frame
    origin_mm: Floats  # (3,). The sample's origin in the robot's frame
    taught_mm: Floats  # (n, 2). The taught points on the face, in the sample's frame
    residual_mm: Floats  # (n,). Distance of each taught robot position from its fitted position
    scale: float  # Ratio of the distances between the robot's points to those of the sample. 1 without touch errors

    @property
    def normal(self) -> Floats:
        """Normal of the face in the robot's frame, (3,)."""
        return self.rotation[:, 2]

    def to_robot_mm(self, sample_mm: Floats) -> Floats:
        """Map points, (n, 3), from the sample's frame to the robot's."""
        return sample_mm @ self.rotation.T + self.origin_mm

    def error_growth(self, sample_mm: Floats) -> float:
        """Return the factor by which a touch error grows at the worst point, sqrt(1 / n + x' S^-1 x).

        ``sample_mm`` is (m, 2 or 3). n is the number of taught points, x the worst point's position from their mean,
        and S the sum of x x' over the taught points.
        """
        planes = [np.column_stack([np.ones(len(at_mm)), at_mm[:, :2]]) for at_mm in (self.taught_mm, sample_mm)]
        return float(lengths(planes[1] @ np.linalg.pinv(planes[0])).max())


def fit_frame(sample_mm: Floats, robot_mm: Floats, *, limit_mm: float, where: str) -> RobotFrame:
    """Fit the rotation and shift that map points on the face, (n, 2), to the taught points, (n, 3) (Kabsch 1976).

    Raises InputError, with ``where`` first, if the points are nearly on a line or mirrored, or if a residual is larger
    than ``limit_mm``.
    """
    taught = np.column_stack([sample_mm, np.zeros(len(sample_mm))])
    middle, robot_middle = taught.mean(axis=0), robot_mm.mean(axis=0)
    spread, robot_spread = taught - middle, robot_mm - robot_middle
    thin_mm = np.linalg.svd(spread, compute_uv=False)[1] / np.sqrt(len(spread))
    if thin_mm < THINNEST_MM:
        raise InputError(
            f"{where}: the taught points are within {thin_mm:.2g} mm (RMS) of a line, so the face's tilt about that "
            f"line is unknown. They must deviate from the line by at least {THINNEST_MM:g} mm (RMS). Teach a point "
            "far from the others, such as a corner of the face."
        )
    rotation = Rotation.align_vectors(robot_spread, spread)[0].as_matrix()
    scale = float(np.sum(robot_spread * (spread @ rotation.T)) / np.sum(spread**2))
    origin_mm = robot_middle - rotation @ middle
    residual_mm = lengths(taught @ rotation.T + origin_mm - robot_mm)
    if residual_mm.max() > limit_mm:
        worst = int(residual_mm.argmax())
        x, y = sample_mm[worst]
        raise InputError(
            f"{where}: the taught points do not fit a sample that is only rotated and shifted: point {worst + 1}, "
            f"sample_mm = [{x:g}, {y:g}], is {residual_mm[worst]:.2f} mm off, and at most {limit_mm:g} mm is allowed "
            f"(frame_limit_mm). The robot's points are {scale:.4g} times as far apart as the sample's; both are in "
            "millimetres. Teach the points again, or check their order, their numbers and the photo's scale."
        )
    if rotation[2, 2] <= 0:
        raise InputError(
            f"{where}: the taught points are mirrored: they make the sample's face point downward. Perhaps two of "
            "them are exchanged, or their y counts downward; y must count upward as in outline.json. For a hanging "
            "arm, teach them in a frame of the controller whose z points up."
        )
    return RobotFrame(rotation, origin_mm, sample_mm, residual_mm, scale)


@dataclass(frozen=True)
class PumpTable:
    """Flow that a pump delivers as a function of the requested flow, interpolated linearly between weighings."""

    name: str  # Name of the file, for messages
    asked_mm3_s: Floats  # (n,), increasing requested flows
    given_mm3_s: Floats  # (n,), increasing delivered flows
    delay_s: Floats  # (n,), time from the request to the first sealant
    # Relative half-width of a flow's 95 % interval. None if the weighings of a flow are equal and show no scatter
    error_95: float | None
    warnings: tuple[str, ...] = ()

    @property
    def range_mm3_s(self) -> tuple[float, float]:
        """Smallest and largest weighed flow."""
        return float(self.given_mm3_s[0]), float(self.given_mm3_s[-1])

    def asked_for(self, wanted_mm3_s: Floats) -> Floats:
        """Return the requested flow for each wanted flow, (n,). A flow of 0 needs a request of 0.

        Raises InputError if a flow is outside the weighed range.
        """
        low, high = self.range_mm3_s
        inside = (wanted_mm3_s >= low * (1 - TOLERANCE)) & (wanted_mm3_s <= high * (1 + TOLERANCE))
        if not (inside | (wanted_mm3_s == 0)).all():
            wrong_mm3_s = wanted_mm3_s[~inside].max()
            raise InputError(
                f"{self.name}: the path needs {wrong_mm3_s:.4g} mm³/s, but the pump is calibrated only from {low:.4g} "
                f"to {high:.4g} mm³/s. Calibrate it at that flow too, or digitise with another path.speed_mm_s or "
                "path.volume_ml."
            )
        return np.interp(wanted_mm3_s, self.given_mm3_s, self.asked_mm3_s) * inside


def read_pump(pump: Pump, folder: Path) -> PumpTable:
    """Read the weighings of a pump from ``pump.file``, which is relative to ``folder`` or absolute.

    Raises InputError, with file and row, if the file is not valid, or if the weighings do not determine the flow.
    """
    path = folder / pump.file
    columns = read_columns(path, BOUNDS, NEEDED, ROWS)
    asked, weighed_g, time_s = (np.array(columns[name]) for name in NEEDED)
    flow = 1e6 * weighed_g / pump.density_kg_m3 / time_s
    flows, group, count = np.unique(asked, return_inverse=True, return_counts=True)
    outflow, delay = (
        np.bincount(group, values) / count for values in (flow, columns.get("delay_s", np.zeros(len(asked))))
    )
    freedom = len(asked) - len(flows)
    if len(flows) < 2 or freedom < 2:
        raise InputError(
            f"{path}: the file has {len(asked)} weighings of {len(flows)} flows. At least 2 flows are needed, and at "
            "least 2 weighings that repeat an earlier flow, since a single weighing shows no scatter."
        )
    times = np.median(outflow / flows)
    if not 1 / MISTYPED < times < MISTYPED:
        raise InputError(
            f"{path}: according to its weighings the pump delivers {times:.3g} times the requested flow, but no pump "
            f"is off by a factor of {MISTYPED:g}. Check the units: asked_mm3_s in mm³/s, weighed_g in g, time_s in "
            "seconds and not minutes, and the pump's density_kg_m3 in kg/m³."
        )
    if (falls := np.diff(outflow) <= 0).any():
        after = int(falls.argmax()) + 1
        raise InputError(
            f"{path}: at a request of {flows[after]:g} mm³/s the pump delivered {outflow[after]:.4g}, no more than "
            f"the {outflow[after - 1]:.4g} at {flows[after - 1]:g}, so no flow between them can be requested. Weigh "
            "again, or omit the request that the pump does not follow."
        )
    scatter = np.sqrt(((flow / outflow[group] - 1) ** 2).sum() / freedom)
    # Between two flows, the line is off the true curve by about 1/4 of a flow's distance from its neighbours' line.
    off = [
        np.interp(flows[n], np.delete(flows, n), np.delete(outflow, n)) / outflow[n] - 1
        for n in range(1, len(flows) - 1)
    ]
    bend = np.abs(off).max(initial=0.0) / 4
    # The flow with the fewest weighings is the most uncertain.
    of_mean = stdtrit(freedom, 0.975) * scatter / np.sqrt(count.min())
    half = float(np.linalg.norm([of_mean, 1.96 * pump.density_error_kg_m3 / pump.density_kg_m3, bend]))
    error_95, warning = (half, SCATTERS.format(scatter, half)) if scatter >= ROUNDING else (None, NO_SCATTER)
    doubtful = error_95 is None or error_95 > DOUBTFUL
    return PumpTable(path.name, flows, outflow, delay, error_95, (f"{path.name}: {warning}",) * doubtful)
