"""The base of every table in a trial file: frozen, unknown keys refused, no NaN, no infinity."""

from pydantic import BaseModel, ConfigDict


class Settings(BaseModel):
    """One table of a trial file. Subclasses document each field beside it; units stand in the names."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        # A quoted "16" is a typo in a file of numbers, not a number.
        strict=True,
    )
