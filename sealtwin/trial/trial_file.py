"""Trial file: the settings of all stages in one TOML file, checked before anything runs."""

import difflib
import os
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from digitise.settings import NO_SCALE, CrackShape, MeshInput, NozzlePath, PhotoInput
from sealtwin.core.errors import InputError, present
from sealtwin.core.records import Outline, Sample, Solid
from sealtwin.core.settings import Settings, SettingsFaults, checked, dotted_names, read_toml
from simulate.material_file import Material
from simulate.pour import Pour
from simulate.settings import LAWS, Fluid, Nozzle, SampleSlope, Solver, excluded_by
from validate.settings import ANGLE, Gate, Readings, Uncertainty

LONGEST_FOLDER_BYTES = 120
MOST_SEEDS = 20  # Most runs of one trial that differ only in the seed

PRINTABLE = r"^[^\x00-\x1f\x7f]*[^\x00-\x20\x7f][^\x00-\x1f\x7f]*$"  # Pattern of one line that is not blank
LINE_BREAKING = re.compile(r"[\x00-\x1f\x7f]")
"""Control characters. The name of a file may have them, but that of a trial may not."""


SettingValues = Mapping[str, Any]
"""Settings of a trial by dotted name."""
Name = Annotated[str, Field(min_length=1, max_length=80, pattern=PRINTABLE)]
Seed = Annotated[int, Field(ge=0, lt=2**31)]
Moment = Annotated[float, Field(ge=0, le=9999)]


class Output(Settings):
    """Pictures and frames of a run, which do not change its result."""

    frames_every_s: float | None = Field(default=None, ge=1e-3, le=9999)
    """Simulated time between two frames in frames/, for ParaView and 'sealtwin film'. Default: no frames. A film of a
    pour of 15 s needs about 0.1: 150 frames of up to 0.7 MB in the paper's trial.
    """
    snapshots_s: tuple[Moment, ...] = Field(default=(0.5, 7.0, 15.0), max_length=100)
    """Simulated times of the fill in the report and in snapshots/. The default has those of the paper; [] for none."""
    pictures: bool = False
    """Write report.pdf, and PNGs of the snapshots and of the run's numerical health, with the report."""


class FluidOfFile(Fluid):
    # Required in a trial, since a default would be a guess: the sealant of the paper stiffens.
    freeze_after_s: float | Literal["never"]  # pyright: ignore[reportGeneralTypeIssues]


MOST_APART = 0.03  # Largest difference of the densities in two tables, as a share: each is measured to a percent


class Trial(Settings):
    """A crack, how it is sealed, and the readings taken afterwards."""

    name: Name
    """Name of the trial in the report, and of its folder under reports/."""
    note: Annotated[str, Field(max_length=2000)] = ""
    """Note in the report, with what a reader must know about this trial."""
    seed: Seed = 0
    """Seed of the small random offsets of the particles at the nozzle."""
    seeds: Annotated[int, Field(ge=1, le=MOST_SEEDS)] | None = None
    """Runs with seeds seed, seed + 1 and so on, 1 to 20. The level is their mean, with the band of one further run."""
    photo: PhotoInput | None = None
    crack: CrackShape | None = None  # Depth and walls, which a mesh shows but a photo does not
    mesh: MeshInput | None = None  # Mesh, instead of photo and crack
    sample: SampleSlope = SampleSlope()  # Slopes of the sample's face
    path: NozzlePath = NozzlePath()
    fluid: FluidOfFile | None = None  # Needed for the fluid run only
    solver: Solver = Solver()
    nozzle: Nozzle = Nozzle()
    output: Output = Output()
    readings: Readings | None = None  # Without readings, the report shows only the simulated profile
    gate: Gate | None = None
    uncertainty: Uncertainty = Uncertainty()
    """Standard uncertainties of the inputs. 'sealtwin validate RUN --uncertainty' computes that of the result."""

    @field_validator("seeds")
    @classmethod
    def _several(cls, seeds: int | None) -> int | None:
        """Return None for one run, which is a trial without ``seeds``."""
        return None if seeds == 1 else seeds

    @model_validator(mode="after")
    def _one_sample(self) -> Self:
        if self.mesh is not None and (self.photo is not None or self.crack is not None):
            raise ValueError(
                "[mesh] cannot be combined with [photo] or [crack], since a mesh has its own depth and walls; give one "
                "or the other"
            )
        if self.mesh is None and self.photo is None:
            raise ValueError("[photo] or [mesh] is missing: give one, which shows the crack")
        if self.photo is not None and self.crack is None and not self.photo.path_only:
            raise ValueError("[crack] is missing: give its depth_mm, which a photo does not show")
        return self

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        face = self.photo and self.photo.face_mm
        if face is not None and self.nozzle.diameter_mm >= min(face):
            raise ValueError(
                f"nozzle.diameter_mm is {self.nozzle.diameter_mm:g}: it must be below the face's smaller side, "
                f"photo.face_mm = {list(face)}"
            )
        if face is not None and sum(self.path.trims_mm) >= sum(face):
            raise ValueError(
                f"path.trim_mm removes {sum(self.path.trims_mm):g} mm, but no crack in this face is so long: give a "
                "smaller path.trim_mm"
            )
        if self.seeds is not None and not self.solver.has_particles:
            raise ValueError(
                f"seeds = {self.seeds}: the fast model computes the same level with every seed; leave seeds out"
            )
        if self.gate is not None and self.readings is None:
            raise ValueError("[gate] without [readings]: a gate needs readings to compare with; add them or remove it")
        if self.crack is not None and self.crack.fill is not None and getattr(self.uncertainty, ANGLE) is not None:
            raise ValueError(
                f"uncertainty.{ANGLE} cannot be combined with crack.fill, which determines it: omit uncertainty.{ANGLE}"
            )
        if self.path.weighed is not None and self.uncertainty.volume_ml is not None:
            raise ValueError(
                "uncertainty.volume_ml cannot be combined with path.weighed, which determines it: omit "
                "uncertainty.volume_ml"
            )
        fitted = () if self.readings is None or self.readings.fitted is None else self.readings.fitted
        if unknown := [name for name in fitted if name not in SETTINGS]:
            raise ValueError(f"readings.fitted: {'; '.join(map(no_such_setting, unknown))}")
        return self

    @property
    def shown_by(self) -> PhotoInput | MeshInput:
        """Photo or mesh, the input that shows the crack."""
        return present(self.photo or self.mesh, "photo or mesh")

    @property
    def given_fluid(self) -> Fluid:
        """The trial's fluid. Raises InputError if it has none."""
        if self.fluid is None:
            raise InputError("the trial has no [fluid]: give viscosity_pa_s, or U and D_cm.")
        return self.fluid

    def pour(self, sample: Sample) -> Pour:
        """Return what a run of the trial is computed from. Raises InputError if the trial has no fluid."""
        return Pour(sample, (self.given_fluid,), self.solver, self.nozzle, self.seed, self.sample)

    def loaded(self, folder: Path) -> Self:
        """Return the trial with the content of files that fluid, fill and path name. Raises InputError if unusable."""
        crack, fluid, uncertainty = self.crack, self.fluid, self.uncertainty
        if crack is not None and crack.fill is not None:
            crack = crack.model_copy(update={"fill": crack.fill.loaded(folder)})
        if fluid is not None:
            fluid = fluid.loaded(folder)
            if isinstance(measured := fluid.material, Material):
                uncertainty = uncertainty.with_paste(measured.yield_stress_error_pa, measured.viscosity_error_percent)
            if (weighed := self.path.weighed) is not None:
                apart = abs(fluid.density_kg_m3 - weighed.density_kg_m3)
                if apart > MOST_APART * fluid.density_kg_m3:
                    raise InputError(
                        f"path.weighed.density_kg_m3 is {weighed.density_kg_m3:g} and fluid.density_kg_m3 is "
                        f"{fluid.density_kg_m3:g}: one sealant has one density. Give the measured one in both."
                    )
        loaded = {"crack": crack, "path": self.path.loaded(folder), "fluid": fluid, "uncertainty": uncertainty}
        return self.model_copy(update=loaded)

    @property
    def content(self) -> dict[str, Any]:
        """The tables of the trial file, without settings that are not set."""
        return self.model_dump(mode="json", exclude_none=True)

    def changed(self, settings: SettingValues, where: Path) -> "Trial":
        """Return the trial with settings by dotted name; None unsets one. Raises InputError, which names ``where``."""
        return checked(Trial, where, with_settings(self.content, settings))

    def known_inputs(self, outline: Outline, solid: Solid) -> Uncertainty:
        """Return the uncertainties that are declared, and those that follow from photo, fill and weighed volume."""
        inputs = self.uncertainty.with_sample(outline.width_doubt_mm, solid.figures.weighed)
        if self.fluid is not None and self.fluid.D_cm is not None:
            # D is a drag of its own, in place of a share of the paste's stress.
            inputs = inputs.without("wall_share")
        weighed = self.path.weighed
        return inputs if weighed is None else inputs.model_copy(update={"volume_ml": weighed.volume_sd_ml})

    @property
    def can_be_varied(self) -> bool:
        """True if extra runs add something: the effect of declared inputs, or particles' error beside readings."""
        return bool(self.uncertainty.moved) or (self.readings is not None and self.solver.has_particles)

    @property
    def folder_name(self) -> str:
        return folder_name(self.name)


OF_ANY_DRAFT = ("solver.model", "solver.settle_s")  # Settings of the solver that a draft leaves as they are
TABLES = ("fluid", "solver", "nozzle", "path", "crack", "sample")
"""Tables of a trial file with settings that a study may vary, and that may have been fitted to readings."""
SETTINGS = ("seed", *(key for key in dotted_names(Trial) if key.partition(".")[0] in TABLES))
"""Dotted names of the seed and of all settings in TABLES."""


def no_such_setting(name: str) -> str:
    """Return the beginning of a sentence on a name that is not in ``SETTINGS``."""
    close = difflib.get_close_matches(name, SETTINGS, n=1, cutoff=0.8)
    if close:
        return f"{name}: no such setting; the nearest is '{close[0]}'"
    return f'{name}: no such setting; expected seed or a key of [{"], [".join(TABLES)}], such as "fluid.U"'


def refuse_seeds(trial: Trial, where: object) -> None:
    """Raise InputError if a trial whose runs have one seed each has ``seeds``."""
    if trial.seeds is not None:
        raise InputError(
            f"{where}: seeds = {trial.seeds} is for 'sealtwin run', 'quick', 'simulate' and 'validate'. Here each run "
            "has one seed: leave seeds out, or give --set seeds=1."
        )


def folder_name(name: str) -> str:
    """Return the name without characters that file systems or shells treat specially."""
    plain = "".join(letter if letter.isalnum() or letter in "-_." else "-" for letter in name)
    # File systems count bytes, and a letter may take four.
    return plain.encode()[:LONGEST_FOLDER_BYTES].decode(errors="ignore").strip(".-") or "trial"


def load_trial(path: Path, settings: SettingValues | None = None) -> Trial:
    """Read and check a trial file. ``settings`` by dotted name replace those of the file.

    Raises InputError as ``read_settings`` does. The message names this call instead of the file if the fault is in
    ``settings``, which are options of a command or arguments of a function.
    """
    replacements = settings or {}
    content = read_toml(path, name="trial file", starter="'sealtwin init DIR' writes a trial to start from")

    def named(key: str) -> str:
        below = any(f"{key}.".startswith(f"{name}.") for name in replacements)
        above = key not in Trial.model_fields and any(name.startswith(f"{key}.") for name in replacements)
        return "settings of this call" if below or above else str(path)

    return checked_trial(path, with_settings(content, replacements), named)


def checked_trial(path: Path, content: Mapping[str, Any], origin: Callable[[str], str] | None = None) -> Trial:
    """Return a trial; ``path`` is its file or its photo. A refusal for want of a scale names markers in the photo."""
    try:
        return checked(Trial, path, content, origin)
    except SettingsFaults as fault:
        if NO_SCALE not in fault.types:
            raise
        from digitise.photo import offer_of_markers

        photo = path.parent / content["photo"]["file"] if path.suffix == ".toml" else path
        raise InputError(f"{fault}{offer_of_markers(photo)}") from None


def sample_trial(kind: Literal["photo", "mesh"], file: Path, settings: SettingValues) -> Trial:
    """Return a trial of a photo or a mesh without a fluid, from which solid and path can be made.

    ``settings`` are by dotted name. Raises InputError as ``load_trial`` does.
    """
    if f"{kind}.file" in settings:
        raise InputError(f"{kind}.file and {file} are both given: give one {kind}.")
    content = {"name": name_of(file, kind), kind: {"file": file.name, "data": "undeclared"}}
    return checked_trial(file, with_settings(content, settings))


def name_of(file: Path, otherwise: str) -> str:
    """Return the name of a trial after its photo, mesh or drawing."""
    return LINE_BREAKING.sub("-", file.stem)[:80].strip() or otherwise


def seen_from(folder: Path, settings: SettingValues, source: Path = Path()) -> dict[str, Any]:
    """Return settings whose files are relative to ``folder``, the trial's, instead of to ``source``.

    Trial and files can then be moved together, and no home folder is named.
    """
    return {name: _seen_from(folder, value, source) for name, value in settings.items()}


def _seen_from(folder: Path, value: Any, source: Path) -> Any:
    if isinstance(value, dict):
        return seen_from(folder, value, source)
    if not isinstance(value, Path):
        return value
    file = source / value
    try:
        # If a folder is a link, ".." leads to the folder above its target.
        return Path(os.path.relpath(file.parent.resolve() / file.name, folder.resolve())).as_posix()
    except ValueError:
        # On another drive on Windows.
        return file.absolute().as_posix()


IN_PLACE_OF = {
    **{f"fluid.{key}": [f"fluid.{name}" for name in excluded_by(key)] for key in LAWS if key != "material"},
    "path.volume_ml": ["path.weighed", "path.fill"],
}
"""Settings that a given setting removes from the trial: those of other laws of flow, or of another volume."""


def with_settings(content: Mapping[str, Any], settings: SettingValues) -> dict[str, Any]:
    """Return a trial's tables with ``settings``, by dotted name, and without the settings that these exclude."""
    changed = dict(content)
    for name, value in settings.items():
        *tables, key = name.split(".")
        home = changed
        for table in tables:
            home[table] = dict(inner) if isinstance(inner := home.get(table), dict) else {}
            home = home[table]
        home[key] = value
        others = [other for other in IN_PLACE_OF.get(name, ()) if value is not None and other.partition(".")[2] in home]
        # D is the drag of the walls that was fitted together with U.
        others += ["fluid.D_cm"] * ("fluid.U" in others)
        for other in set(others) - set(settings):
            home.pop(other.partition(".")[2], None)
    return changed


def replaced(trial: Trial, settings: SettingValues, names: Iterable[str]) -> list[str]:
    """Return those of ``settings`` that would be removed from a trial if all of ``names`` were given."""
    content = trial.content
    removed = names_in(content) - names_in(with_settings(content, dict.fromkeys(names, 0)))
    return [name for name in settings if ".".join(name.split(".")[:2]) in removed]


def names_in(content: Mapping[str, Any]) -> set[str]:
    """Return the dotted names of the settings in a trial's tables."""
    return {f"{table}.{key}" for table, inner in content.items() if isinstance(inner, dict) for key in inner}


def trial_text(trial: Trial) -> str:
    """Return the trial as TOML with all defaults written out."""
    import tomlkit

    document = tomlkit.document()
    document.add(tomlkit.comment("Resolved by sealtwin: every setting of this run, defaults written out."))
    for key, value in trial.content.items():
        document.add(key, value)
    return tomlkit.dumps(document)


def sets_resolution(names: Iterable[str]) -> bool:
    """Return True if ``names`` has a setting of the solver that a draft would replace."""
    return any(name.startswith("solver.") and name not in OF_ANY_DRAFT for name in names)


def drafted(trial: Trial, sample: Sample) -> Trial:
    """Return a trial with preset "draft", as its run resolves it.

    A trial of the fast model or of another preset is returned as it is.
    """
    if not trial.solver.has_particles or trial.solver.preset != "accurate":
        return trial
    changes = {"preset": "draft", "substeps": None, "iterations": None}
    return as_run(trial.model_copy(update={"solver": trial.solver.model_copy(update=changes)}), sample)


def as_run(trial: Trial, sample: Sample) -> Trial:
    """Return a trial with the particle radius, U and D of its run. Raises InputError without a fluid."""
    from simulate.setup_checks import resolved

    fluid, solver = resolved(sample, trial.given_fluid, trial.solver, trial.nozzle)
    return trial.model_copy(update={"fluid": fluid, "solver": solver})
