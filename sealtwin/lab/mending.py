"""What a trial has lost of the files that were kept in it, and how it gets them back; nothing is overwritten."""

from dataclasses import asdict, dataclass
from pathlib import Path

from sealtwin.errors import InputError
from sealtwin.lab.catalogue import RECORD, KeptFile, Record
from sealtwin.lab.keeping import TRIAL, copy_raw, put_in_place
from sealtwin.lab.prepared import Prepared
from sealtwin.store import files
from sealtwin.trials.trial import trial_text


@dataclass(frozen=True)
class Losses:
    """What of a trial is not as it was taken in. Its trial.toml may be: that is the user's to edit."""

    folder_is_there: bool
    gone: tuple[str, ...]
    """Names in its folder."""
    changed: tuple[KeptFile, ...]
    """There, but with other bytes."""

    def __bool__(self) -> bool:
        return bool(self.gone or self.changed)

    def can_be_mended(self, record: Record, prepared: Prepared) -> bool:
        """Whether the lab's folder holds what is gone byte for byte: a sheet of several samples may have changed."""
        at_hand = {(raw.kept_as, raw.sha256) for raw in prepared.raw}
        return all((file.kept_as, file.sha256) in at_hand for file in record.files if file.kept_as in self.gone)

    def refuse_changed(self, lab: Path, record: Record) -> None:
        """Raises InputError, a sentence for each."""
        if self.changed:
            raise InputError(
                "\n".join(
                    f"{lab / record.folder / file.kept_as}: other bytes than were taken in from {file.original}. Move "
                    "it away, and the same command puts the lab's own back; or make the change in the lab's folder."
                    for file in self.changed
                )
            )


def losses_of(lab: Path, record: Record) -> Losses:
    """Compare a trial's folder with its record, byte for byte."""
    folder = lab / record.folder
    kept = {file.kept_as: file for file in record.files}
    gone = [name for name in (*kept, TRIAL, RECORD) if not (folder / name).is_file()]
    changed = [file for name, file in kept.items() if name not in gone and files.sha256(folder / name) != file.sha256]
    return Losses(folder.is_dir(), tuple(gone), tuple(changed))


def mend(lab: Path, record: Record, losses: Losses, prepared: Prepared) -> None:
    """Put back what is gone: a folder as a whole, or else file by file.

    Raises InputError where a file of the lab's changes meanwhile.
    """
    assert prepared.trial is not None, "only what can be read is put back"
    if not losses.folder_is_there:
        put_in_place(lab, record, prepared)
        return
    folder = lab / record.folder
    for raw in prepared.raw:
        if raw.kept_as in losses.gone:
            with files.replacing(folder / raw.kept_as) as temporary:
                copy_raw(raw, temporary)
    if TRIAL in losses.gone:
        files.write_text(folder / TRIAL, trial_text(prepared.trial))
    if RECORD in losses.gone:
        files.write_json(folder / RECORD, asdict(record))
