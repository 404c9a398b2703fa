"""One trial: the stages' own settings in one TOML file, checked before anything runs."""

import difflib
import json
import re
import tomllib
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, ValidationError, model_validator
from pydantic_core import ErrorDetails

from digitise.settings import CrackShape, NozzlePath, PhotoInput
from sealtwin.errors import InputError
from sealtwin.settings import Settings
from simulate.settings import Fluid, Nozzle, Solver
from validate.settings import Gate, Readings

LARGEST_TRIAL_BYTES = 200_000
"""A trial file is some kilobytes; anything like this is another file given by mistake."""
DEEP_KEY = re.compile(r"(?<![\w\"'-])(?:[\w\"'-]++\s*+\.\s*+){16}")
"""A dotted key of thousands of parts makes a table for each: gigabytes from kilobytes."""
LONGEST_FOLDER_BYTES = 120

PRINTABLE = r"^[^\x00-\x1f\x7f]*[^\x00-\x20\x7f][^\x00-\x1f\x7f]*$"
"""One line, and not spaces alone."""


class Trial(Settings):
    """A crack, how it is sealed, and what was measured of it afterwards."""

    name: Annotated[str, Field(min_length=1, max_length=80, pattern=PRINTABLE)]
    """Shown in the report, and the name of its folder under reports/."""
    note: Annotated[str, Field(max_length=2000)] = ""
    """Shown in the report: what a reader must know about this trial."""
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0
    """Of the small disorder with which particles leave the nozzle."""
    photo: PhotoInput
    crack: CrackShape
    path: NozzlePath = NozzlePath()
    fluid: Fluid | None = None
    """Only the fluid run needs it; a mesh and a path do not."""
    solver: Solver = Solver()
    nozzle: Nozzle = Nozzle()
    readings: Readings | None = None
    """Left out, the report shows the simulated profile and compares nothing."""
    gate: Gate | None = None

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        face = self.photo.face_mm
        if face is not None and self.nozzle.diameter_mm >= min(face):
            raise ValueError(
                f"nozzle.diameter_mm is {self.nozzle.diameter_mm:g}: it must be below the face's smaller side, "
                f"photo.face_mm = {list(face)}"
            )
        if face is not None and 2 * self.path.trim_mm >= sum(face):
            raise ValueError(f"path.trim_mm is {self.path.trim_mm:g}: no crack of this face is long enough for it")
        if self.gate is not None and self.readings is None:
            raise ValueError("[gate] without [readings]: there is nothing to hold it against")
        return self

    @property
    def folder_name(self) -> str:
        """The name, less what file systems or shells stumble over."""
        kept = "".join(letter if letter.isalnum() or letter in "-_." else "-" for letter in self.name)
        # File systems count bytes, and a letter may take four.
        return kept.encode()[:LONGEST_FOLDER_BYTES].decode(errors="ignore").strip(".-") or "trial"


def load_trial(path: Path) -> Trial:
    """Read and check a trial file.

    Raises:
        InputError: the file is missing, no TOML, or holds a key or a value that cannot be; every fault is named with
            its key, the value found and what is allowed.
    """
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; give the trial.toml in it.")
    if not path.is_file():
        raise InputError(f"{path}: no such file. 'sealtwin init DIR' writes a trial to start from.")
    if path.stat().st_size > LARGEST_TRIAL_BYTES:
        raise InputError(f"{path}: larger than {LARGEST_TRIAL_BYTES} bytes; this is no trial file.")
    try:
        # Windows' Notepad opens a file with a byte-order mark.
        text = path.read_text(encoding="utf-8-sig")
        if DEEP_KEY.search(text):
            raise InputError(f"{path}: a key of more than 16 parts; a trial file has tables of one level.")
        content = tomllib.loads(text)
    except UnicodeDecodeError:
        raise InputError(f"{path}: no UTF-8 text; a trial file is TOML. 'sealtwin init DIR' writes one.") from None
    except (ValueError, RecursionError) as fault:
        raise InputError(f"{path}: no valid TOML: {fault}.") from None
    return _checked(path, content)


def photo_trial(
    photo: Path,
    *,
    depth_mm: float,
    mm_per_px: float | None,
    face_mm: tuple[float, float] | None,
    assumed: bool,
    ends_px: tuple[tuple[float, float], tuple[float, float]] | None,
    tilt: str | None,
    wall_angle_deg: float | None,
    volume_ml: float | None,
) -> Trial:
    """The trial of somebody who only wants a mesh and a path from a photo. Raises InputError as ``load_trial``."""
    content = {
        "name": photo.stem[:80] or "photo",
        "photo": {
            "file": photo.name,
            "data": "measured",
            "mm_per_px": mm_per_px,
            "face_mm": face_mm,
            "ends_px": ends_px,
            "scale_is": "assumed" if assumed else "measured",
        },
        "crack": _given(depth_mm=depth_mm, tilt=tilt, wall_angle_deg=wall_angle_deg),
        "path": _given(volume_ml=volume_ml),
    }
    return _checked(photo, content)


def trial_text(trial: Trial) -> str:
    """The trial as TOML, defaults written out: what a run was made from."""
    import tomlkit

    document = tomlkit.document()
    document.add(tomlkit.comment("Resolved by sealtwin: every setting of this run, defaults written out."))
    for key, value in json.loads(trial.model_dump_json(exclude_none=True)).items():
        document.add(key, value)
    return tomlkit.dumps(document)


def _given(**options: Any) -> dict[str, Any]:
    """Those that were given; the rest keep the settings' own defaults."""
    return {name: value for name, value in options.items() if value is not None}


def _checked(path: Path, content: dict[str, Any]) -> Trial:
    try:
        # JSON is the form in which strict types still take a list for a tuple and a string for a path.
        return Trial.model_validate_json(json.dumps(content, default=str))
    except ValidationError as fault:
        raise InputError("\n".join(_sentence(path, error) for error in fault.errors())) from None


def _sentence(path: Path, error: ErrorDetails) -> str:
    where = ".".join(str(part) for part in error["loc"] if not _is_type_name(part))
    found = error["input"]
    if error["type"] == "extra_forbidden":
        close = difflib.get_close_matches(str(error["loc"][-1]), _keys_beside(error["loc"]), n=1)
        allowed = f"did you mean '{close[0]}'?" if close else f"allowed: {', '.join(_keys_beside(error['loc']))}."
        return f"{path}: {where}: no such key; {allowed}"
    if error["type"] == "missing":
        return f"{path}: {where} is missing; it has no default, so it must be given."
    if error["type"] == "string_pattern_mismatch":
        return f"{path}: {where} = {found!r}: must be one line of text, not blank and without control characters."
    reason = error["msg"].removeprefix("Value error, ").removeprefix("Input ")
    if isinstance(found, dict | list):
        return f"{path}: {where}: {reason}." if where else f"{path}: {reason}."
    return f"{path}: {where} = {found!r}: {reason}."


def _is_type_name(part: int | str) -> bool:
    """Branches of a union, which pydantic adds to the place of an error and no user wrote."""
    return isinstance(part, str) and (part in {"float", "int", "str"} or part.startswith(("literal[", "constrained-")))


def _keys_beside(location: tuple[int | str, ...]) -> list[str]:
    """Keys that the table of a misspelt key knows."""
    table: Any = Trial
    for part in location[:-1]:
        if isinstance(part, str) and part in table.model_fields:
            inner = _settings_in(table.model_fields[part].annotation)
            if inner is None:
                return []
            table = inner
    return sorted(table.model_fields)


def _settings_in(annotation: Any) -> Any:
    """The settings class inside X, X | None or tuple[X, ...]."""
    if isinstance(annotation, type) and issubclass(annotation, Settings):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        if (found := _settings_in(inner)) is not None:
            return found
    return None
