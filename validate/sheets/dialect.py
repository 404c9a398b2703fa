"""How a sheet was understood: to be said aloud, so that a wrong reading is seen before it is believed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from validate.settings import Datum, Decimal, Quantity, Unit
from validate.sheets.faults import shown
from validate.wording import counted

Layout = Literal["wide", "long"]
"""wide: the repeats of a station are columns of its row; long: each reading has a row of its own."""
IN_WORDS: dict[Datum, str] = {
    "sample_surface": "the sample surface",
    "sealant_top": "the sealant's top",
    "caliper_base": "the caliper's base",
}


@dataclass(frozen=True)
class Dialect:
    written: tuple[str, ...]
    """The file, in words: ("CSV", "UTF-16", "semicolons")."""
    decimal: Decimal | None
    """None where no number was written with a mark."""
    layout: Layout
    repeats: int
    """Most readings of a station."""
    missing: int
    """Readings that the sheet says are missing."""
    quantity: Quantity
    station_unit: Unit
    units: tuple[Unit, ...]
    """Of the readings, each once."""
    datum: Datum
    datum_level_mm: float
    above: int
    """Lines above the header."""
    skipped: tuple[str, ...]
    """Names of columns that hold no readings."""
    remarks: tuple[str, ...]

    @property
    def sentence(self) -> str:
        decimal = () if self.decimal is None else (f"decimal {self.decimal}",)
        file = ", ".join((*self.written, *decimal))
        layout = f"{self.layout}, {counted(self.repeats, 'repeat')}"
        upward = "upward" if self.quantity == "level" else "downward"
        counted_so = f"{self.quantity} {upward} in {' and '.join(self.units)} from {IN_WORDS[self.datum]}"
        if self.datum != "sample_surface":
            counted_so += f", {self.datum_level_mm:+g} mm from the sample surface"
        if self.units != (self.station_unit,):
            counted_so += f", places in {self.station_unit}"
        return "; ".join((file, layout, counted_so, *self._asides()))

    def _asides(self) -> Sequence[str]:
        asides = []
        if self.missing:
            asides.append(f"{counted(self.missing, 'reading')} missing")
        if self.above:
            asides.append(f"{counted(self.above, 'line')} above the header")
        if self.skipped:
            asides.append("not readings: " + ", ".join(shown(name) for name in self.skipped[:8]))
        return (*asides, *self.remarks)
