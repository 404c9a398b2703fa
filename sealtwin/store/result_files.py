"""What results in JSON hold, field by field: people edit run folders, and not all they write can be a result."""

from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

MOST_PARTICLES = 2_000_000
"""A table of them is as large as any that is read."""

Length = Annotated[float, Field(gt=0, le=1e3)]
"""mm; nothing in a sample is longer."""
Error = Annotated[float, Field(ge=0, le=1e3)]
Count = Annotated[int, Field(ge=0, le=MOST_PARTICLES)]


class Result(BaseModel):
    """Exact types, finite numbers; what is not named here is kept as it is."""

    model_config = ConfigDict(frozen=True, strict=True, extra="allow", allow_inf_nan=False)


class FluidInEffect(Result):
    density_kg_m3: Annotated[float, Field(gt=0, le=1e5)] | None = None
    yield_stress_pa: Annotated[float, Field(ge=0, le=1e6)] = 0.0
    structuration_pa_per_s: Annotated[float, Field(ge=0, le=1e6)] = 0.0
    freeze_after_s: Annotated[float, Field(ge=0, le=1e6)] | Literal["never"] | None = None


class SolverInEffect(Result):
    preset: str | None = None
    pressure: str | None = None
    settle_s: Annotated[float, Field(ge=0, le=1e6)] = 0.0


class NozzleInEffect(Result):
    diameter_mm: Length | None = None


class SettingsInEffect(Result):
    """Those that a report computes with or speaks of."""

    fluid: FluidInEffect = FluidInEffect()
    solver: SolverInEffect = SolverInEffect()
    nozzle: NozzleInEffect = NozzleInEffect()


class Simulation(Result):
    """simulation.json: a run without its particles."""

    particles: Annotated[int, Field(ge=1, le=MOST_PARTICLES)]
    radius_mm: Length
    particle_volume_mm3: Annotated[float, Field(gt=0, le=1e9)]
    dispensed_volume_mm3: Annotated[float, Field(gt=0, le=1e9)]
    escaped_particles: Count
    spilled_particles: Count
    device: str
    settings: SettingsInEffect
    health: dict[str, int | float | None]

    @property
    def volume_ratio(self) -> float:
        """Raises ValueError where the run recorded none."""
        if (ratio := self.health.get("volume_ratio")) is None:
            raise ValueError("health.volume_ratio is missing")
        return ratio


class Judged(Result):
    """comparison.json: its numbers that are read again."""

    mean_error_mm: Error
    worst_error_mm: Error
    worst_at_mm: float
    passed: bool | None
    verdict: str


Kind = TypeVar("Kind", bound=Result)


def understood_as(kind: type[Kind], content: Any) -> Kind:
    """Raises ValueError in one sentence, naming the first field that cannot be."""
    try:
        return kind.model_validate(content)
    except ValidationError as fault:
        first = fault.errors()[0]
        where = ".".join(str(part) for part in first["loc"] if part not in ("int", "float"))
        found = "" if first["type"] == "missing" else f" = {first['input']!r:.60}"
        raise ValueError(f"{where or 'its content'}{found}: {first['msg'].removeprefix('Input ')}") from None
