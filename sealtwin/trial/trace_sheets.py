"""Photos of trials for the trace page, with the functions that save their hints."""

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from digitise.image.decoding import PHOTO_SUFFIXES
from digitise.settings import PhotoInput
from digitise.trace_page.page import Opened, Sheet
from digitise.trace_page.session import UNSCALED_MM_PER_PX, Hints, Shape, TraceSession
from sealtwin.core.errors import InputError
from sealtwin.core.settings import checked
from sealtwin.trial.photo_hints import NewTrial, TrialFile
from sealtwin.trial.trial_file import load_trial, seen_from, with_settings


def sheets_in(folder: Path, given: Mapping[str, Any]) -> list[Sheet]:
    """Return the trials with a photo in a folder, and its photos without a trial, sorted by name.

    ``given`` has settings by dotted name that replace the trials' own. Raises InputError if there are neither trials
    nor photos.
    """
    sheets: dict[Path, Sheet] = {}
    for trial in sorted(folder.glob("*.toml")):
        try:
            settings = load_trial(trial).photo
        except InputError:
            # Its photo would get a second trial of the same name, which is refused when the photo is opened.
            continue
        if settings is not None:
            # A mask does not show another crack.
            named = (settings.file, settings.mask)
            sheets |= {(folder / one).resolve(): sheet_of(trial, given) for one in named if one is not None}
    photos = [file for file in folder.iterdir() if file.suffix.lower() in PHOTO_SUFFIXES and file.is_file()]
    sheets |= {file.resolve(): sheet_of(file, given) for file in photos if file.resolve() not in sheets}
    if not sheets:
        raise InputError(f"{folder}: contains neither a photo nor a trial with a photo.")
    unique = {sheet.name: sheet for sheet in sheets.values()}
    return [unique[name] for name in sorted(unique)]


def sheet_of(path: Path, given: Mapping[str, Any]) -> Sheet:
    """Return the sheet of a trial file, or of a photo without a trial.

    ``given`` has settings by dotted name that replace the trial's own.
    """
    return Sheet(path.name, lambda: _opened(path, given), lambda: _traced(path))


def _traced(path: Path) -> bool:
    trial = path if path.suffix.lower() == ".toml" else path.with_suffix(".toml")
    try:
        photo = load_trial(trial).photo if trial.is_file() else None
    except InputError:
        return False
    return photo is not None and (photo.ends_px is not None or photo.mask is not None)


def _opened(path: Path, given: Mapping[str, Any]) -> Opened:
    """Return the session of a trial file or of a photo, the function that saves its hints, and facts for the page."""
    # The page may have saved a trial for this photo before.
    if path.suffix.lower() != ".toml" and _traced(path):
        path = path.with_suffix(".toml")
    if path.suffix.lower() == ".toml":
        loaded = load_trial(path, given)
        settings = loaded.photo
        if settings is None:
            raise InputError(f"{path}: this trial starts from a mesh and has no photo to trace.")
        # A path without a solid has no [crack].
        shape = Shape() if loaded.crack is None else Shape.of(loaded.crack)
        trial, hints = TrialFile(path, given), Hints.of(settings)
        facts = {"saves_to": f"Saves into {path.name}, and keeps its comments."}
        runs, new = loaded.fluid is not None, False
        tables = [key for key in Shape.model_fields if isinstance(getattr(loaded.crack, key, None), tuple)]
    else:
        trial = NewTrial(path, given)
        settings, hints = _of_photo(path, given)
        shape, tables = _shape(path, given)
        facts = {"saves_to": f"Writes {trial.path.name} beside the photo, with the starter's sealant."}
        runs, new = True, True
    facts |= {"is_new": new, "path_only": bool(settings.path_only), "shape": shape.said(), "tables": tables}

    def save(hints: Hints, shape: Shape) -> dict[str, Any]:
        changed = trial.save(hints, shape)
        return {
            "file": str(trial.path),
            "changed": changed,
            "summary": f"Saved into {trial.path}: {', '.join(changed) if changed else 'nothing had changed'}.",
            "next": f"sealtwin {'run' if runs else 'digitise'} {shlex.quote(str(trial.path))}",
        }

    return Opened(TraceSession(settings, path.parent, hints), save, facts)


def _of_photo(path: Path, given: Mapping[str, Any]) -> tuple[PhotoInput, Hints]:
    """Return settings and hints of a photo without a trial. Raises InputError if ``given`` has an unusable setting."""
    photo = {"photo": {"file": path.name, "data": "undeclared"}}
    content = with_settings(photo, seen_from(path.parent, given))["photo"]
    has_scale = content.keys() & {"markers", "face_mm", "ruler_px", "mm_per_px"}
    unscaled = {} if has_scale else {"mm_per_px": UNSCALED_MM_PER_PX}
    settings = checked(PhotoInput, path, content | unscaled)
    return settings, Hints.of(settings).model_copy(update=dict.fromkeys(unscaled))


def _shape(path: Path, given: Mapping[str, Any]) -> tuple[Shape, list[str]]:
    """Return the crack's shape in ``given``, and the names of its settings whose value is a table.

    Raises InputError if a value cannot be used.
    """
    values = {key: given[f"crack.{key}"] for key in Shape.model_fields if f"crack.{key}" in given}
    tables = [key for key, value in values.items() if isinstance(value, list)]
    return checked(Shape, path, {key: value for key, value in values.items() if key not in tables}), tables
