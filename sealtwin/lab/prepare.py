"""Read the notes and sheets of a sample, and make the settings of its trial. All that is open becomes a question."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path, PurePath
from typing import Any

from digitise.settings import LARGEST_FILE_BYTES, NO_SCALE
from sealtwin.core import files
from sealtwin.core.doubts import Doubt
from sealtwin.core.errors import InputError
from sealtwin.core.settings import checked
from sealtwin.lab.files import DEFAULTS, NAMED_FILES, PICTURES, KeptFile, Role
from sealtwin.lab.notes import ALTERNATIVES, DEPTH, OF_READINGS, OWN, SCALE, Note, read_note
from sealtwin.lab.pairing import note_of_answers
from sealtwin.lab.sample import PAIRING, SETTINGS, LabSample
from sealtwin.trial.job import LARGEST_SHEET_BYTES
from sealtwin.trial.quick_trial import ASSUMED, toml_value
from sealtwin.trial.trial_file import Trial, names_in, with_settings
from validate.readings.grid import SheetFaults
from validate.readings.read_readings import read_readings
from validate.settings import Declared

INPUTS = Path("inputs")
ANGLE, FILL = "crack.wall_angle_deg", "crack.fill"
STARTER = ASSUMED | {"crack.tilt": "lean", ANGLE: 11.0, "path.fill": 1.0, "path.trim_mm": 10.0}
"""Settings that are used if no note gives them: those of fluid and solver are of 'sealtwin init', which let the sealant
settle before its level is measured; the others are the defaults of a trial."""
EXCLUDED = {
    "path.plan": "path.",
    "path.weighed": "path.volume_ml",
    "solver.model": "solver.",  # The fast model has neither particles nor a rest.
    "fluid.freeze_after_s": "fluid.yield_stress_pa",
    FILL: ANGLE,
}
"""Beginnings of settings of the starter that a given setting excludes."""
ORIGIN = 'write data = "measured" (or "reconstructed", "synthetic")'
NEEDED: Mapping[str, tuple[Role, Any, str]] = {
    "photo.data": ("photo", "synthetic", ORIGIN),
    DEPTH: ("photo", 16.0, "no photo shows it: write [crack] depth_mm = 16.0"),
    "crack.tilt": (
        "fill",
        "funnel",
        "the steps of a fill need it: write [crack] tilt = 'funnel' or, for walls that open downward, 'undercut' if "
        "the photo shows the mouth's width, 'flare' if it shows the floor's",
    ),
    "readings.data": ("readings", "synthetic", ORIGIN),
    "readings.role": (
        "readings",
        "held-out",
        'write [readings] role = "held-out", or "calibrated-on" if they were used to choose the fluid',
    ),
    SCALE: ("photo", 0.1, NO_SCALE),
}
"""Required settings that no photo shows: role of the file that requires it, value with which the rest is checked, and
what to write."""
SCALES = frozenset[str]().union(*ALTERNATIVES[0])


def gather(sample: LabSample, defaults: Note, of_table: Note) -> None:
    """Read a sample's notes and hash its files; does not read photos and sheets.

    ``defaults`` are settings of all samples, ``of_table`` those of this one in a table of the folder.
    """
    own = of_table
    every: list[tuple[Role, PurePath]] = [(role, file) for role in sample.files for file in sample.files[role]]
    for number, (role, file) in enumerate(every):
        path, limit = sample.folder / file, LARGEST_FILE_BYTES if role in PICTURES else LARGEST_SHEET_BYTES
        if path.is_symlink() or not path.is_file():
            sample.ask(f"{path}: not a plain file; links are not followed: copy the file itself.")
        elif (size := path.stat().st_size) > limit:
            sample.ask(f"{path}: {size / 1e6:,.0f} MB; the limit for such a file is {limit / 1e6:,.0f} MB.")
        else:
            name = role if sample.file(role) else f"{role}-{number}"
            kept_as = (INPUTS / f"{name}{file.suffix.lower()}").as_posix()
            sample.raw.append(KeptFile(role, file.as_posix(), kept_as, files.sha256(path), size))
            if role == "note" and "photo" in sample.files:
                own = own.beside(read_note(path, sample.key, answered=bool(sample.answers[role, file].get(SETTINGS))))
    if "readings" not in sample.files:
        # The folder's settings of readings, as those of fills, are for other samples.
        own, defaults = own.without("readings.data"), defaults.without(*OF_READINGS)
        for key in [key for key in own.entries if key.startswith(OF_READINGS) and "photo" in sample.files]:
            sample.ask(f"{own.entries[key].origin}: {key} is given, but the sample has no readings; add its sheet.")
        own = own.without(*OF_READINGS)
    sample.note = own.over(defaults.without(ANGLE if "fill" in sample.files else FILL))
    for (role, file), answers in sample.answers.items():
        if role == "note" or sample.file(role):
            sample.note = note_of_answers(answers, f"{PAIRING}, {file}").over(sample.note)
    sample.ask(*sample.note.faults)


def prepare(sample: LabSample) -> None:
    """Read the sheets of a sample and make its trial, even if it has questions; add all others.

    Settings that are missing have a stand-in, so that the rest is checked at the same time.
    """
    from digitise.photo import offering_markers

    for file in sample.files.get("readings", ()):
        if any(raw.original == file.as_posix() for raw in sample.raw):
            _read(sample, file)
    if "photo" not in sample.files:
        return
    settings = _settings_of(sample)
    missing = {key for key, (role, *_) in NEEDED.items() if role in sample.files} - settings.keys()
    sample.stand_ins = missing - {SCALE} if settings.keys() & SCALES else missing
    for key in (key for key in NEEDED if key in sample.stand_ins):
        _, settings[key], remedy = NEEDED[key]
        fault = f"{key} is missing: {remedy} in {DEFAULTS}, or in the sample's note (NAME.toml)."
        sample.ask(offering_markers(fault, sample.folder / sample.files["photo"][0]) if key == SCALE else fault)
    if not sample.files.get("readings"):
        settings = {key: value for key, value in settings.items() if not key.startswith(OF_READINGS)}
    excluded = tuple(begin for key, begin in EXCLUDED.items() if key in settings)
    left = names_in(with_settings(with_settings({}, STARTER), settings)) - settings.keys()
    assumed = {key: value for key, value in STARTER.items() if key in left and not key.startswith(excluded)}
    if assumed:
        listed = ", ".join(f"{key} = {toml_value(value)}" for key, value in assumed.items())
        sentence = f"Assumed, since no note of the lab gives it: {listed}."
        settings = {"note": sentence} | settings
        sample.remarks.append(f"{sentence} Write your own values, best into {DEFAULTS}.")
    content = with_settings(with_settings({}, assumed), settings)
    try:
        trial = checked(Trial, sample.folder, content, lambda key: _origin_of(sample, key))
        sample.trial = trial if sample.file("photo") else None
    except InputError as fault:
        sample.ask(*str(fault).splitlines())


def _declared(path: Path, note: Note, sample: str | None = None) -> Declared | None:
    """Return what a note declares about a sheet; None if a value is wrong, which is reported as a fault of its key."""
    of_sheets = tuple(f"readings.{name}" for name in Declared.model_fields)
    given = {key: entry.value for key, entry in note.entries.items() if key.startswith(of_sheets)}
    with suppress(InputError):
        return checked(Declared, path, with_settings({"readings": {"sample": sample}}, given)["readings"])
    return None


def _read(sample: LabSample, file: PurePath) -> None:
    """Read a sheet of readings as a run does, without the crack's length."""
    path, depth = sample.folder / file, sample.note.entries.get(DEPTH)
    depth_mm = depth.value if depth is not None and isinstance(depth.value, int | float) else None
    # Without a photo, the name of the file is in question too.
    declared = _declared(path, sample.note, sample.name if "photo" in sample.files else None)
    if declared is None:
        return  # With a wrong answer, all others would be asked about again.
    try:
        profile = read_readings(path, declared, None, depth_mm)
    except InputError as fault:
        sample.ask(*doubts_in(fault), file=file)
        sample.understood = fault.understood if isinstance(fault, SheetFaults) else None
        return
    sample.ask(*profile.questions, file=file)
    sample.understood = profile.understood
    sample.dialect = profile.dialect if sample.file("readings") else None


def _settings_of(sample: LabSample) -> dict[str, Any]:
    """Return the settings of a trial by dotted key, from its notes and its files."""
    entries = sample.note.entries
    settings: dict[str, Any] = {"name": sample.name, "readings.sample": sample.name}
    settings |= {key: entry.value for key, entry in entries.items() if key not in OWN}
    # Without a photo, the other settings are checked.
    kept = {role: (f"{every[0]}", "photo.png") for role, every in sample.files.items() if every}
    kept |= {raw.role: (raw.original, raw.kept_as) for raw in sample.raw}
    for role, key in NAMED_FILES.items():
        original, kept_as = kept.get(role, ("", None))
        if key in entries and PurePath(f"{settings[key]}").name != PurePath(original).name:
            sample.ask(
                f"{entries[key].origin}: {key} = {str(settings[key])!r:.80}, but the sample's {role} is "
                f"{original or 'no file'}; delete the key, and choose the file in the pairing file."
            )
        settings[key] = kept_as
    return {key: value for key, value in settings.items() if value is not None}


def _origin_of(sample: LabSample, key: str) -> str:
    """Return the places that give a setting or a table's settings, otherwise the path of a note of the sample."""
    entries = sample.note.entries.items()
    origins = [entry.origin for name, entry in entries if f"{key}.".startswith(f"{name}.") or name.startswith(key)]
    return ", ".join(dict.fromkeys(origins[::-1])) or str(sample.files["photo"][0].with_suffix(".toml"))


def doubts_in(fault: InputError) -> tuple[Doubt, ...]:
    """Return the parts of an error: those of a sheet, or a sentence of any other one each."""
    if isinstance(fault, SheetFaults):
        return fault.doubts
    parts = (sentence.partition(": ") for sentence in str(fault).splitlines())
    return tuple(Doubt("input", where, finding) for where, _, finding in parts)
