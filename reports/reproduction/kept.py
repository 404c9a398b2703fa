"""What the stages found, kept as data beside the page: a stage computed anew replaces its own, and all else stands."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from reports.reproduction.judging import NOT_COMPUTED, AnyClaim, Finding, Judgement, not_computed
from sealtwin.core import files
from sealtwin.trial.stage_numbers import NUMBERS

KEPT = "kept.json"


@dataclass(frozen=True)
class Found:
    """What is kept of a claim's finding; the claim itself is in the code."""

    ours: str
    redrawn: str
    judgement: Judgement


@dataclass(frozen=True)
class Kept:
    """What the runs of a stage say."""

    computed: str
    """Date of its last run, for example "2026-11-22"."""
    stage_numbers: Mapping[str, int]
    """Those that computed it; empty if they are not recorded."""
    findings: Mapping[str, Found]
    """By the claim's name."""
    told: Mapping[str, Any]
    """What else the page says of it: texts and numbers of its template."""


def kept_of(last_run_unix_s: float, findings: Sequence[Finding], words: Mapping[str, Any] | None = None) -> Kept:
    """Return what is kept of findings by runs of this version's stage numbers."""
    date = time.strftime("%Y-%m-%d", time.gmtime(last_run_unix_s))
    computed = [each for each in findings if each.ours != NOT_COMPUTED]
    findings_by_name = {each.name: Found(each.ours, each.redrawn, each.judgement) for each in computed}
    return Kept(date, dict(NUMBERS), findings_by_name, words or {})


def found_in(claim: AnyClaim[Any], kept: Sequence[Kept]) -> Finding:
    """Return the finding of a claim in the first of those that have it; "not computed yet" where none has."""
    for each in kept:
        if (finding := each.findings.get(claim.name)) is not None:
            return Finding(claim, claim.stated, finding.ours, finding.redrawn, finding.judgement)
    return not_computed(claim)


def read_kept(home: Path) -> dict[str, Kept]:
    """Return what is kept, by the stage's name; nothing where no file is.

    Raises InputError for a damaged file.
    """
    path = home / KEPT
    if not path.is_file():
        return {}
    content = files.read_json(path)
    with files.understood(path):
        return {
            stage: Kept(
                one["computed"],
                one.get("stage_numbers", {}),
                {name: Found(**finding) for name, finding in one["findings"].items()},
                one["told"],
            )
            for stage, one in content.items()
        }


def write_kept(home: Path, kept: Mapping[str, Kept]) -> None:
    files.write_json(home / KEPT, {stage: asdict(kept[stage]) for stage in sorted(kept)})
