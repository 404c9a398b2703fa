"""What a difference between simulation and data allows one to say, after ASME V&V 20 (2009)."""

from dataclasses import dataclass

import numpy as np

from sealtwin.records import Floats
from validate.wording import counted

COVERAGE = 2.0
"""k: an interval of 95 % of a normal distribution."""


@dataclass(frozen=True)
class Comparand:
    """E = S - D of one number, and the standard uncertainties of it; None where one was not determined."""

    error_mm: float
    data_mm: float
    numerics_mm: float | None = None
    inputs_mm: float | None = None

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
        figures = f"E = {self.error_mm:+.2f} mm, {COVERAGE:g} u_val = {half_mm:.2f} mm"
        if not self.resolved:
            said = (
                f"The data cannot resolve an error of the model in the mean level ({figures}): it lies between "
                f"{low_mm:+.2f} and {high_mm:+.2f} mm. This does not say that the model is right."
            )
        else:
            way = "high" if self.error_mm > 0 else "low"
            said = (
                f"The model's mean level is too {way} ({figures}): its error lies between {low_mm:+.2f} and "
                f"{high_mm:+.2f} mm."
            )
        return said + _left_out(self.numerics_mm is None, self.inputs_mm is None)


def station_sentence(errors_mm: Floats, validation_mm: Floats) -> str:
    """Of the levels at the stations, (n,) each."""
    resolved = np.abs(errors_mm) > COVERAGE * validation_mm
    high, low = int((resolved & (errors_mm > 0)).sum()), int((resolved & (errors_mm < 0)).sum())
    rest = len(errors_mm) - high - low
    if not high + low:
        return f"At none of {counted(len(errors_mm), 'station')} is |E| above {COVERAGE:g} u_val."
    return (
        f"At {high + low} of {counted(len(errors_mm), 'station')} |E| is above {COVERAGE:g} u_val: there the model is "
        f"off, too high at {high} and too low at {low}. At the other {rest} the data cannot tell."
    )


def _left_out(numerics: bool, inputs: bool) -> str:
    names = [name for name, missing in (("the numerics", numerics), ("the inputs", inputs)) if missing]
    return f" The doubt about {' and '.join(names)} is not in it." if names else ""
