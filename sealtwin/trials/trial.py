"""One trial: the stages' own settings in one TOML file, checked before anything runs."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from digitise.settings import CrackShape, MeshInput, NozzlePath, PhotoInput
from sealtwin.output import Output
from sealtwin.settings import Settings
from sealtwin.store.settings_file import checked, read_settings
from simulate.settings import Fluid, Nozzle, Solver
from validate.settings import Gate, Readings
from validate.uncertainty.settings import Uncertainty

LONGEST_FOLDER_BYTES = 120

PRINTABLE = r"^[^\x00-\x1f\x7f]*[^\x00-\x20\x7f][^\x00-\x1f\x7f]*$"
"""One line, and not spaces alone."""
LINE_BREAKING = re.compile(r"[\x00-\x1f\x7f]")
"""What a file's name may hold and a trial's must not."""


class Trial(Settings):
    """A crack, how it is sealed, and what was measured of it afterwards."""

    name: Annotated[str, Field(min_length=1, max_length=80, pattern=PRINTABLE)]
    """Shown in the report, and the name of its folder under reports/."""
    note: Annotated[str, Field(max_length=2000)] = ""
    """Shown in the report: what a reader must know about this trial."""
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0
    """Of the small disorder with which particles leave the nozzle."""
    photo: PhotoInput | None = None
    crack: CrackShape | None = None
    """What a photo cannot show; a mesh shows it."""
    mesh: MeshInput | None = None
    """In place of photo and crack."""
    path: NozzlePath = NozzlePath()
    fluid: Fluid | None = None
    """Only the fluid run needs it; a mesh and a path do not."""
    solver: Solver = Solver()
    nozzle: Nozzle = Nozzle()
    output: Output = Output()
    readings: Readings | None = None
    """Left out, the report shows the simulated profile and compares nothing."""
    gate: Gate | None = None
    uncertainty: Uncertainty = Uncertainty()
    """How well the inputs are known; 'sealtwin validate RUN --uncertainty' turns it into that of the result."""

    @model_validator(mode="after")
    def _one_sample(self) -> Self:
        if self.mesh is not None and (self.photo is not None or self.crack is not None):
            raise ValueError("[mesh] beside [photo] or [crack]: a mesh has a depth and walls of its own; give either")
        if self.mesh is None and self.photo is None:
            raise ValueError("no [photo] and no [mesh]: give one to say where the crack is")
        if self.photo is not None and self.crack is None:
            raise ValueError("[crack] is missing: a photo cannot show how deep a crack is")
        return self

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        face = None if self.photo is None else self.photo.face_mm
        if face is not None and self.nozzle.diameter_mm >= min(face):
            raise ValueError(
                f"nozzle.diameter_mm is {self.nozzle.diameter_mm:g}: it must be below the face's smaller side, "
                f"photo.face_mm = {list(face)}"
            )
        if face is not None and sum(self.path.trims_mm) >= sum(face):
            raise ValueError(
                f"path.trim_mm takes {sum(self.path.trims_mm):g} mm: no crack of this face is long enough for it"
            )
        if self.gate is not None and self.readings is None:
            raise ValueError("[gate] without [readings]: there is nothing to hold it against")
        return self

    @property
    def sample(self) -> PhotoInput | MeshInput:
        """What shows the crack."""
        sample = self.photo or self.mesh
        assert sample is not None, "checked when the trial was read"
        return sample

    @property
    def folder_name(self) -> str:
        return folder_name(self.name)


def folder_name(name: str) -> str:
    """The name, less what file systems or shells stumble over."""
    kept = "".join(letter if letter.isalnum() or letter in "-_." else "-" for letter in name)
    # File systems count bytes, and a letter may take four.
    return kept.encode()[:LONGEST_FOLDER_BYTES].decode(errors="ignore").strip(".-") or "trial"


def load_trial(path: Path) -> Trial:
    """Read and check a trial file.

    Raises:
        InputError: the file is missing, no TOML, or holds a key or a value that cannot be; every fault is named with
            its key, the value found and what is allowed.
    """
    return read_settings(Trial, path, name="trial file", starter="'sealtwin init DIR' writes a trial to start from")


def showing(trial: Trial, frames_every_s: float | None) -> Trial:
    """The same trial, its frames written every so often where that is given. Raises InputError."""
    if frames_every_s is None:
        return trial
    output = {**trial.output.model_dump(mode="json"), "frames_every_s": frames_every_s}
    return trial.model_copy(update={"output": checked(Output, Path("--frames-every-s"), output)})


def photo_trial(photo: Path, tables: Mapping[str, Mapping[str, Any]]) -> Trial:
    """The trial of somebody who only wants a mesh and a path from a photo.

    ``tables`` holds what was given of [photo], [crack] and [path]; None stands for what was not. Raises InputError as
    ``load_trial``.
    """
    return _trial_of("photo", photo, {"crack": {}, **tables})


def mesh_trial(mesh: Path, tables: Mapping[str, Mapping[str, Any]]) -> Trial:
    """The same from a mesh; ``tables`` holds what was given of [mesh] and [path]."""
    return _trial_of("mesh", mesh, tables)


def _trial_of(kind: str, file: Path, tables: Mapping[str, Mapping[str, Any]]) -> Trial:
    content: dict[str, Any] = {table: _given(settings) for table, settings in tables.items()}
    content[kind] = {"file": file.name, "data": "measured", **content.get(kind, {})}
    content["name"] = LINE_BREAKING.sub("-", file.stem)[:80].strip() or kind
    return checked(Trial, file, content)


def trial_text(trial: Trial) -> str:
    """The trial as TOML, defaults written out: what a run was made from."""
    import tomlkit

    document = tomlkit.document()
    document.add(tomlkit.comment("Resolved by sealtwin: every setting of this run, defaults written out."))
    for key, value in json.loads(trial.model_dump_json(exclude_none=True)).items():
        document.add(key, value)
    return tomlkit.dumps(document)


def _given(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Those that were given; the rest keep the settings' own defaults."""
    return {name: value for name, value in settings.items() if value is not None}
