"""Samples of which a file takes no part: held back, else they would pass for samples that never had it."""

from collections.abc import Sequence
from dataclasses import replace

from sealtwin.lab.finding import LeftOut
from sealtwin.lab.naming import as_label
from sealtwin.lab.pairing import Sample
from validate.sheets.samples import sample_key


def hold_back(
    samples: Sequence[Sample], left_out: Sequence[LeftOut], folder: str
) -> tuple[list[Sample], list[LeftOut]]:
    """Samples with the files that they have lost, and files left out that are of none of them.

    What was saved anew beside it, P01.csv beside P01.xls, stands in for it. ``folder`` is the name of the lab's own: of
    the sample whose files bear none.
    """
    own: dict[str, list[LeftOut]] = {}
    others = []
    by_key = {sample.key: sample for sample in samples}
    for left in left_out:
        key = "" if left.said is None else sample_key(left.said.sample or as_label(folder))
        sample = by_key.get(key)
        if left.said is not None and sample is not None and not _stands_in(sample, left):
            own.setdefault(key, []).append(left)
        else:
            others.append(left)
    held = [
        replace(sample, lost=tuple(left.sentence for left in own[sample.key])) if sample.key in own else sample
        for sample in samples
    ]
    return held, others


def _stands_in(sample: Sample, left: LeftOut) -> bool:
    return left.said is not None and left.said.role in sample.files
