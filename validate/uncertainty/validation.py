"""What a difference between simulation and data allows one to say, after ASME V&V 20 (2009)."""

from dataclasses import dataclass

import numpy as np

from sealtwin.records import Floats
from validate.wording import counted, signed

COVERAGE = 2.0
"""k: an interval of 95 % of a normal distribution."""


@dataclass(frozen=True)
class Comparand:
    """E = S - D of one number, and the standard uncertainties of it; None where one was not determined."""

    error_mm: float
    data_mm: float
    numerics_mm: float | None = None
    inputs_mm: float | None = None
    inputs_waiting: bool = False
    """Whether inputs are declared that no run has moved yet: then ``inputs_mm`` is of the others."""

    @property
    def validation_mm(self) -> float:
        """u_val: the root of the sum of squares of all that are known."""
        known = [part for part in (self.data_mm, self.numerics_mm, self.inputs_mm) if part is not None]
        return float(np.sqrt(np.square(known).sum()))

    @property
    def resolved(self) -> bool:
        """Whether the data can tell the model's error from nothing."""
        return abs(self.error_mm) > COVERAGE * self.validation_mm

    @property
    def model_error_mm(self) -> tuple[float, float]:
        """Where the error of the model itself lies: E - k u_val to E + k u_val."""
        half_mm = COVERAGE * self.validation_mm
        return self.error_mm - half_mm, self.error_mm + half_mm

    @property
    def sentence(self) -> str:
        """Of the mean level along the crack."""
        half_mm = COVERAGE * self.validation_mm
        low_mm, high_mm = self.model_error_mm
        figures = f"E = {signed(self.error_mm, 2)} mm, {COVERAGE:g} u_val = {half_mm:.2f} mm; ASME V&V 20"
        if not self.resolved:
            said = (
                f"The data cannot resolve an error of the model in the mean level ({figures}): it lies between "
                f"{signed(low_mm, 2)} and {signed(high_mm, 2)} mm. This does not say that the model is right."
            )
        else:
            way = "high" if self.error_mm > 0 else "low"
            # What may be the numbers' or the inputs' fault is not laid at the model's door.
            whose = "simulated" if self.left_out else "model's"
            said = (
                f"The {whose} mean level is too {way} ({figures}): its error lies between {signed(low_mm, 2)} "
                f"and {signed(high_mm, 2)} mm."
            )
        return f"{said} The doubt about {self.left_out} is not in it." if self.left_out else said

    @property
    def left_out(self) -> str:
        """Of the numerics and the inputs, what was not determined; empty where all was."""
        parts = [] if self.numerics_mm is not None else ["the numerics"]
        if self.inputs_mm is None:
            parts.append("the inputs")
        elif self.inputs_waiting:
            parts.append("the other inputs")
        return " and ".join(parts)


def station_sentence(errors_mm: Floats, validation_mm: Floats, left_out: str = "") -> str:
    """Of the levels at the stations, (n,) each; ``left_out`` is what u_val lacks, as ``Comparand`` has it."""
    resolved = np.abs(errors_mm) > COVERAGE * validation_mm
    high, low = int((resolved & (errors_mm > 0)).sum()), int((resolved & (errors_mm < 0)).sum())
    rest = len(errors_mm) - high - low
    if not high + low:
        return f"At none of {counted(len(errors_mm), 'station')} is |E| above {COVERAGE:g} u_val."
    where = f"too high at {high} and too low at {low}"
    off = (
        f"{where}, by more than the readings' uncertainty alone; that of {left_out} is not in it."
        if left_out
        else f"there the model is off, {where}."
    )
    others = f" At the other {rest} the data cannot tell." if rest else ""
    return f"At {high + low} of {counted(len(errors_mm), 'station')} |E| is above {COVERAGE:g} u_val: {off}{others}"
