"""How well the inputs of a trial are known: its table [uncertainty]."""

from typing import Annotated

from pydantic import Field

from sealtwin.settings import Settings

OF_THE_READINGS = ("station_mm", "repeatability_mm")
Standard = Annotated[float, Field(gt=0, le=1000)]


class Uncertainty(Settings):
    """Standard uncertainties, one standard deviation each, of what was set, measured or assumed.

    All are optional and none has a default: what is not declared is not included, and the report says so.
    """

    speed_mm_s: Standard | None = None
    """Of the nozzle's speed. The volume stays: the flow follows."""
    volume_ml: Standard | None = None
    """Of the sealant given, and so of the flow."""
    start_mm: Standard | None = None
    """Of the place where the nozzle starts; the whole path moves along the crack with it."""
    width_mm: Standard | None = None
    """Of the crack's mean width; every width of it in proportion."""
    wall_angle_deg: Standard | None = None
    """Of the tilt of the walls, both alike."""
    depth_mm: Standard | None = None
    """Of the crack's depth, over all of its length."""
    viscosity_percent: Standard | None = None
    yield_stress_pa: Standard | None = None
    station_mm: Standard | None = None
    """Of where the readings' s is 0 along the crack: all stations move together."""
    repeatability_mm: Standard | None = None
    """Standard deviation of a single reading, from earlier work; used only where no station was read twice."""

    @property
    def moved(self) -> dict[str, float]:
        """The declared inputs whose effect takes runs to know, by name."""
        return {name: value for name, value in self if value is not None and name not in OF_THE_READINGS}
