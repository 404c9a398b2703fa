"""Which of several runs do not hold the volume that was dispensed, in one sentence for all of them."""

from collections.abc import Mapping

from validate.statements.cautions import SOUND
from validate.studies.side_by_side import numbered

MOST_NAMED = 28
"""As many as stand side by side; of a larger study's, a number says more than a list."""


def volume_words(ratios: Mapping[int, float]) -> list[str]:
    """What the settled sealant of each run, by its number, fills of what was dispensed; empty where all are sound."""
    low, high = SOUND
    # To the digits that are shown: 1.050 is never too much.
    shown = {number: round(ratio, 3) for number, ratio in ratios.items()}
    off = {number: ratio for number, ratio in shown.items() if not low <= ratio <= high}
    if not off:
        return []
    if len(off) > MOST_NAMED:
        which = f"{len(off)} of {len(ratios)} runs"
    else:
        which = numbered([number - 1 for number in sorted(off)])
    least, most = min(off.values()), max(off.values())
    share = f"{least:.3f}" if least == most else f"{least:.3f} to {most:.3f}"
    return [
        f"Not the volume that was dispensed: in {which} the settled sealant fills {share} of it ({low:g} to {high:g} "
        "is sound), and levels stand where that much would not."
    ]
