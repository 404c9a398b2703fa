"""One sample of a lab's folder: taken in, known already, mended, or named with all that is wrong with it."""

import traceback
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from sealtwin.errors import InputError, as_text
from sealtwin.lab.catalogue import Catalogue, Record
from sealtwin.lab.keeping import keep
from sealtwin.lab.mending import Losses, losses_of, mend
from sealtwin.lab.notes import Note
from sealtwin.lab.pairing import Sample
from sealtwin.lab.prepared import Prepared, gather
from sealtwin.lab.trials import prepare
from sealtwin.progress import Progress

Fate = Literal["new", "revised", "unchanged", "restored", "failed", "bug"]
"""restored: known already, and files that its trial had lost are back."""


@dataclass(frozen=True)
class Outcome:
    """What became of one sample."""

    sample: Sample
    fate: Fate
    faults: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    trial: str | None = None
    """Its folder; in a dry run there is none yet."""
    revision: int | None = None
    dialect: str | None = None


@dataclass(frozen=True)
class Work:
    """What all samples of one ingest share."""

    folder: Path
    defaults: Note
    lab: Path
    catalogue: Catalogue
    progress: Progress
    dry_run: bool
    sound: list[Prepared] = field(default_factory=list)
    """Samples in which nothing was wrong, as they are taken in."""

    @property
    def source(self) -> str:
        return as_text(self.folder)


def take_in(sample: Sample, work: Work) -> Outcome:
    """Whatever is wrong with it, or becomes wrong on the way, is its own; but for a fault of the disk of the lab."""
    prepared = Prepared(sample)
    try:
        prepared = gather(work.folder, sample, work.defaults)
        if (outcome := _taken_in(prepared, work)) is not None:
            work.sound.append(prepared)
            return outcome
    except InputError as fault:
        prepared.faults += str(fault).splitlines()
    except OSError as fault:
        if fault.filename is None or Path(fault.filename).is_relative_to(work.lab):
            raise
        prepared.faults.append(f"{fault.filename}: {fault.strerror}. Make it readable.")
    except Exception as fault:
        # A bug of ours that one sample wakes must not cost the others theirs; it is told of, and ends with code 1.
        work.progress.note(traceback.format_exc())
        last = traceback.extract_tb(fault.__traceback__)[-1]
        place = f"{Path(last.filename).name}, line {last.lineno}"
        report = f"{sample.name}: {type(fault).__name__} in {place}: {fault}. A bug of ours: please report it."
        return Outcome(sample, "bug", (report,))
    return Outcome(sample, "failed", tuple(_from(work.folder, fault) for fault in prepared.faults))


def _taken_in(prepared: Prepared, work: Work) -> Outcome | None:
    """None where something is wrong with the sample, which ``prepared`` then says. Raises InputError too."""
    sample = prepared.sample
    before = None if sample.questions else work.catalogue.latest(sample.key)
    if before is not None and not prepared.faults:
        if before.content == prepared.content:
            losses = losses_of(work.lab, before)
            if not losses:
                return _as_before("unchanged", sample, before)
            if losses.can_be_mended(before, prepared):
                return _mended(losses, prepared, before, work)
        _refuse_namesake(prepared, before, work.source)
    if not sample.questions:
        prepare(work.folder, prepared)
    if prepared.faults:
        return None
    fate: Fate = "new" if before is None else "revised"
    if work.dry_run:
        return Outcome(sample, fate, (), tuple(prepared.remarks), dialect=prepared.dialect)
    record = keep(work.lab, work.source, prepared, before)
    work.catalogue.add(record)
    return Outcome(sample, fate, (), record.remarks, record.folder, record.revision, record.dialect)


def _as_before(fate: Fate, sample: Sample, before: Record, *news: str) -> Outcome:
    remarks = (*before.remarks, *news)
    return Outcome(sample, fate, (), remarks, before.folder, before.revision, before.dialect)


def _mended(losses: Losses, prepared: Prepared, before: Record, work: Work) -> Outcome | None:
    """None where it cannot be read again. Raises InputError where a kept file is another one by now."""
    prepare(work.folder, prepared)
    if prepared.faults:
        return None
    if not work.dry_run:
        mend(work.lab, before, losses, prepared)
    losses.refuse_changed(work.lab, before)
    gone = ", ".join(losses.gone) if losses.folder_is_there else "its folder"
    put_back = "would be put back" if work.dry_run else "put back"
    return _as_before(
        "restored",
        prepared.sample,
        before,
        f"{before.folder}: {gone} was gone, and is {put_back} from the lab's files.",
    )


def _from(folder: Path, sentence: str) -> str:
    """Files as the lab knows them: from its own folder on, which is absolute here."""
    return sentence.replace(f"{folder}/", "")


def _refuse_namesake(prepared: Prepared, before: Record, source: str) -> None:
    """Another folder's sample of the same name is another sample, unless its photo is the same."""
    photo = before.file("photo")
    same_photo = photo is not None and any(raw.sha256 == photo.sha256 for raw in prepared.raw)
    if before.source != source and not same_photo:
        raise InputError(
            f"{prepared.sample.files['photo']}: a sample {before.name} with another photo came from {before.source}; "
            "give this one another name in the pairing file."
        )
