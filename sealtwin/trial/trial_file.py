"""Read trial files. A trial file is a TOML file with the settings of all stages, which are checked before a run."""

import difflib
import os
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import Field, field_validator

from digitise.drawing.given import DrawingInput
from digitise.settings import NO_SCALE, CrackShape, MeshInput, NozzlePath, PhotoInput
from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline, Sample, Solid
from sealtwin.core.settings import Settings, SettingsFaults, checked, dotted_names, read_toml, without_none
from simulate.material_file import Material
from simulate.pour import Pour
from simulate.settings import LAWS, Fluid, Nozzle, SampleSlope, Solver, excluded_by
from validate.settings import ANGLE, OF_THE_READINGS, Gate, Readings, Uncertainty
from validate.units import assumed_words

LONGEST_FOLDER_BYTES = 120
MAX_SEEDS = 20  # Largest number of runs of one trial that differ only in the seed

PRINTABLE = r"^[^\x00-\x1f\x7f]*[^\x00-\x20\x7f][^\x00-\x1f\x7f]*$"  # Pattern of one line that is not blank
LINE_BREAKING = re.compile(r"[\x00-\x1f\x7f]")
"""Pattern of control characters. The name of a file may contain them, but the name of a trial may not."""


SettingValues = Mapping[str, Any]
"""Settings of a trial by dotted name."""
Name = Annotated[str, Field(min_length=1, max_length=80, pattern=PRINTABLE)]
Seed = Annotated[int, Field(ge=0, lt=2**31)]
Moment = Annotated[float, Field(ge=0, le=9999)]


class Output(Settings):
    """Pictures and snapshots of a run, which do not change its result."""

    snapshots_s: tuple[Moment, ...] = Field(default=(0.5, 7.0, 15.0), max_length=100)
    """Simulated times of the snapshots, up to 100. The report shows some of them, and snapshots/ has all, for ParaView.
    The default times are from the paper. An empty list gives no snapshots."""
    pictures: bool = False
    """Write report.pdf, and PNG files of the snapshots, with the report."""


class FluidOfFile(Fluid):
    # This setting is required in a trial. A default would be a guess, since the paper's sealant stiffens with its age.
    freeze_after_s: float | Literal["never"]  # pyright: ignore[reportGeneralTypeIssues]


MAX_APART = 0.03  # Largest relative difference of the densities in two tables. Each is measured to one percent


Kind = Literal["photo", "mesh", "drawing"]


class Trial(Settings):
    """A crack, the settings with which it is sealed, and the readings taken afterwards."""

    name: Name
    """Name of the trial in the report, and of its folder in reports/."""
    note: Annotated[str, Field(max_length=2000)] = ""
    """Note in the report that states what a reader must know about this trial."""
    assumed: tuple[str, ...] = ()
    """Settings in this file that were neither measured nor chosen for this crack, such as "crack.tilt". The report
    lists them, and the settings in ``UNMEASURED`` that the file does not give. Delete a name once you know the value.
    """
    seed: Seed = 0
    """Seed of the small random offsets of the particles at the nozzle."""
    seeds: Annotated[int, Field(ge=1, le=MAX_SEEDS)] | None = None
    """Number of runs, 1 to 20, with the seeds seed, seed + 1 and so on. The level is the mean of the runs, with a band
    for one further run."""
    photo: PhotoInput | None = None
    crack: CrackShape | None = None  # Depth and walls of the crack, which a mesh shows but a photo does not
    mesh: MeshInput | None = None  # Mesh that replaces photo and crack
    drawing: DrawingInput | None = None  # Drawing that replaces the photo
    sample: SampleSlope = SampleSlope()  # Slopes of the sample's face
    path: NozzlePath = NozzlePath()
    fluid: FluidOfFile | None = None  # Settings of the sealant, which only the fluid run requires
    solver: Solver = Solver()
    nozzle: Nozzle = Nozzle()
    output: Output = Output()
    readings: Readings | None = None  # Without readings, the report shows only the simulated profile
    gate: Gate | None = None
    uncertainty: Uncertainty = Uncertainty()
    """Standard uncertainties of the inputs. 'sealtwin validate RUN --uncertainty' computes the result's uncertainty."""

    @field_validator("seeds")
    @classmethod
    def _several(cls, seeds: int | None) -> int | None:
        """Return None for one run, so that trials with ``seeds = 1`` and without ``seeds`` are equal."""
        return None if seeds == 1 else seeds

    def _check(self) -> None:
        shown = [f"[{kind}]" for kind in KINDS if getattr(self, kind) is not None]
        if len(shown) != 1:
            fault = (
                f"{' and '.join(shown)} cannot be combined" if shown else f"one of [{'], ['.join(KINDS)}] is missing"
            )
            raise ValueError(f"{fault}; give exactly one of them to show the crack")
        if self.mesh is not None and self.crack is not None:
            raise ValueError("[mesh] cannot be combined with [crack], since a mesh already has depth and walls")
        if self.mesh is None and self.crack is None and not (self.photo and self.photo.path_only):
            raise ValueError(f"[crack] is missing; give crack.depth_mm (--depth-mm), which no {self.kind} shows")
        if unknown := [name for name in self.assumed if name not in (*SETTINGS, *ORIGINS)]:
            raise ValueError(f"assumed: {'; '.join(map(no_such_setting, unknown))}")
        face = self.photo and self.photo.face_mm
        if face is not None and self.nozzle.diameter_mm != "auto" and self.nozzle.size_mm >= min(face):
            raise ValueError(
                f"nozzle.diameter_mm is {self.nozzle.size_mm:g}, but it must be smaller than both sides of the "
                f"face, photo.face_mm = {list(face)}"
            )
        if face is not None and sum(self.path.trims_mm) >= sum(face):
            raise ValueError(
                f"path.trim_mm removes {sum(self.path.trims_mm):g} mm, but a crack in this face cannot be so long; "
                "give a smaller path.trim_mm"
            )
        if self.seeds is not None and not self.solver.has_particles:
            raise ValueError(
                f"seeds = {self.seeds}, but the fast model computes the same level with each seed; leave out seeds"
            )
        if self.gate is not None and self.readings is None:
            raise ValueError("[gate] requires readings for the comparison; add [readings], or remove [gate]")
        if self.crack is not None and self.crack.fill is not None and getattr(self.uncertainty, ANGLE) is not None:
            raise ValueError(
                f"uncertainty.{ANGLE} follows from crack.fill, so they cannot be combined; omit uncertainty.{ANGLE}"
            )
        if self.path.weighed is not None and self.uncertainty.volume_ml is not None:
            raise ValueError(
                "uncertainty.volume_ml follows from path.weighed, so they cannot be combined; omit "
                "uncertainty.volume_ml"
            )
        if self.readings is not None and self.readings.scan is not None:
            of_calipers = (*OF_THE_READINGS, "pass_mm", "repeatability_mm")
            if declared := [name for name in of_calipers if getattr(self.uncertainty, name) is not None]:
                raise ValueError(
                    f"uncertainty.{declared[0]} is an error of caliper readings, but readings.scan gives a scan; omit "
                    f"uncertainty.{declared[0]}"
                )
        fitted = () if self.readings is None or self.readings.fitted is None else self.readings.fitted
        if unknown := [name for name in fitted if name not in SETTINGS]:
            raise ValueError(f"readings.fitted: {'; '.join(map(no_such_setting, unknown))}")

    @property
    def kind(self) -> Kind:
        """Table of the input that shows the crack."""
        return next(kind for kind in KINDS if getattr(self, kind) is not None)

    @property
    def shown_by(self) -> PhotoInput | MeshInput | DrawingInput:
        """Input that shows the crack: the photo, the mesh or the drawing."""
        return getattr(self, self.kind)

    @property
    def assumptions(self) -> dict[str, Any]:
        """Settings that were neither given nor measured, by dotted name: those that the trial names, and defaults."""
        homes = {name: getattr(self, name.partition(".")[0]) for name in (*self.assumed, *UNMEASURED, *ORIGINS)}
        values = {name: getattr(home, name.partition(".")[2]) for name, home in homes.items() if home is not None}
        names = [*self.assumed]
        names += [
            name for name in UNMEASURED if name in values and name.split(".")[1] not in homes[name].model_fields_set
        ]
        names += [name for name, value in values.items() if value == "undeclared"]
        names += ["photo.mm_per_px"] * (self.photo is not None and self.photo.scale_is == "assumed")
        idle = {"path."} if self.path.plan is not None else {"path.fill"} if self.path.volume_ml != "cavity" else set()
        if self.crack and (not any(self.crack.tilting) or self.crack.fill is not None):
            idle.add("crack.wall_angle_deg")
        # With U and no yield stress, the density only converts units.
        if self.fluid and (self.fluid.material or (self.fluid.U and not self.fluid.yields)):
            idle.add("fluid.density_kg_m3")
        return without_none(
            {name: values.get(name) for name in dict.fromkeys(names) if not name.startswith(tuple(idle))}
        )

    @property
    def given_fluid(self) -> Fluid:
        """Settings of the trial's fluid. Raises InputError if the trial has no fluid."""
        if self.fluid is None:
            raise InputError("the trial has no table [fluid]; give viscosity_pa_s, or U and D_cm.")
        return self.fluid

    @property
    def assumed_words(self) -> tuple[str, ...]:
        """The ``assumptions`` in words with their values."""
        return assumed_words(self.assumptions)

    def pour(self, sample: Sample) -> Pour:
        """Return the input of the trial's fluid run. Raises InputError if the trial has no fluid."""
        return Pour(sample, (self.given_fluid,), self.solver, self.nozzle, self.seed, self.sample)

    def loaded(self, folder: Path) -> Self:
        """Return the trial with the content of the files that its fluid, fill and path name.

        Raises InputError if a file cannot be used.
        """
        crack, fluid, uncertainty = self.crack, self.fluid, self.uncertainty
        if crack is not None and crack.fill is not None:
            crack = crack.model_copy(update={"fill": crack.fill.loaded(folder)})
        if fluid is not None:
            fluid = fluid.loaded(folder)
            if isinstance(measured := fluid.material, Material):
                uncertainty = uncertainty.with_paste(measured.yield_stress_error_pa, measured.viscosity_error_percent)
            if (weighed := self.path.weighed) is not None:
                apart = abs(fluid.density_kg_m3 - weighed.density_kg_m3)
                if apart > MAX_APART * fluid.density_kg_m3:
                    raise InputError(
                        f"path.weighed.density_kg_m3 is {weighed.density_kg_m3:g} and fluid.density_kg_m3 is "
                        f"{fluid.density_kg_m3:g}, but a sealant has only one density. Give the measured density in "
                        "both keys."
                    )
        loaded = {"crack": crack, "path": self.path.loaded(folder), "fluid": fluid, "uncertainty": uncertainty}
        return self.model_copy(update=loaded)

    @property
    def content(self) -> dict[str, Any]:
        """Tables of the trial file as a dict, without settings that are None."""
        content = self.model_dump(mode="json", exclude_none=True)
        # All settings are written, so those that had their defaults are named.
        return content | {"assumed": [name for name in self.assumptions if name not in ORIGINS]}

    def changed(self, settings: SettingValues, where: Path) -> "Trial":
        """Return the trial with changed settings by dotted name. None removes a setting.

        Raises InputError, whose message begins with ``where``, if a setting is not valid.
        """
        return checked(Trial, where, with_settings(self.content, settings))

    def known_inputs(self, outline: Outline, solid: Solid) -> Uncertainty:
        """Return the declared uncertainties, and the uncertainties from the photo, the fill and the weighed volume."""
        inputs = self.uncertainty.with_sample(outline.width_doubt_mm, solid.figures.weighed)
        if self.fluid is not None and self.fluid.D_cm is not None:
            # D sets the drag of the walls directly, so ``wall_share`` does not apply.
            inputs = inputs.without("wall_share")
        weighed = self.path.weighed
        return inputs if weighed is None else inputs.model_copy(update={"volume_ml": weighed.volume_sd_ml})

    @property
    def can_be_varied(self) -> bool:
        """True if extra runs can add to the result.

        They compute the effect of declared inputs, and with readings the numerical error of particle runs.
        """
        return bool(self.uncertainty.moved) or (self.readings is not None and self.solver.has_particles)

    @property
    def folder_name(self) -> str:
        return folder_name(self.name)


OF_ANY_DRAFT = ("solver.model", "solver.settle_s")  # Settings of the solver that a draft does not change
KINDS: tuple[Kind, ...] = get_args(Kind)
UNMEASURED = (
    "crack.tilt",
    "crack.wall_angle_deg",
    "path.fill",
    "path.trim_mm",
    "path.speed_mm_s",
    "nozzle.diameter_mm",
    "fluid.density_kg_m3",
)
"""Settings whose defaults are assumed if the trial does not give them. Other defaults are choices of the method."""
ORIGINS = ("photo.data", "mesh.data", "drawing.data", "readings.data", "readings.role", "photo.mm_per_px")
"""Settings that state an origin, and the scale, whose origin is photo.scale_is."""
TABLES = ("fluid", "solver", "nozzle", "path", "crack", "sample")
"""Tables of a trial file with settings that a study may vary, and that may have been fitted to readings."""
SETTINGS = ("seed", *(key for key in dotted_names(Trial) if key.partition(".")[0] in TABLES))
"""Dotted names of the seed and of all settings in ``TABLES``."""


def no_such_setting(name: str) -> str:
    """Return the beginning of a message about a name that is not in ``SETTINGS``."""
    close = difflib.get_close_matches(name, SETTINGS, n=1, cutoff=0.8)
    if close:
        return f"{name}: no such setting; the most similar name is '{close[0]}'"
    return f'{name}: no such setting; expected seed or a key of [{"], [".join(TABLES)}], such as "fluid.U"'


def refuse_seeds(trial: Trial, where: object) -> None:
    """Raise InputError if the trial has ``seeds``. For use where each run has one seed."""
    if trial.seeds is not None:
        raise InputError(
            f"{where}: seeds = {trial.seeds} is only for 'sealtwin run', 'quick', 'simulate' and 'validate'. In this "
            "command, each run has one seed: leave out seeds, or give --set seeds=1."
        )


def folder_name(name: str) -> str:
    """Return a name for a folder, without characters that file systems or shells treat specially."""
    plain = "".join(letter if letter.isalnum() or letter in "-_." else "-" for letter in name)
    # File systems limit the number of bytes, and a letter may have four.
    return plain.encode()[:LONGEST_FOLDER_BYTES].decode(errors="ignore").strip(".-") or "trial"


def load_trial(path: Path, settings: SettingValues | None = None) -> Trial:
    """Read and check a trial file. ``settings`` by dotted name replace settings of the file.

    ``settings`` are options of a command or arguments of a function. Raises the same errors as ``read_settings``. If
    the fault is in ``settings``, the message names this call instead of the file.
    """
    replacements = settings or {}
    content = read_toml(path, name="trial file", starter="'sealtwin init DIR' writes an example")

    def named(key: str) -> str:
        below = any(f"{key}.".startswith(f"{name}.") for name in replacements)
        above = key not in Trial.model_fields and any(name.startswith(f"{key}.") for name in replacements)
        return "settings of this call" if below or above else str(path)

    return checked_trial(path, with_settings(content, replacements), named)


def checked_trial(path: Path, content: Mapping[str, Any], origin: Callable[[str], str] | None = None) -> Trial:
    """Return a checked trial. ``path`` is the trial file, or the file that shows the crack.

    If the trial has no name, it gets that of ``path``. If the scale is missing, the message suggests the markers that
    are visible in the photo.
    """
    try:
        return checked(Trial, path, {"name": name_of(path), **content}, origin)
    except SettingsFaults as fault:
        if NO_SCALE not in fault.types:
            raise
        from digitise.photo import offer_of_markers

        photo = path.parent / content["photo"]["file"] if path.suffix == ".toml" else path
        raise InputError(f"{fault}{offer_of_markers(photo)}") from None


def name_of(file: Path) -> str:
    """Return the default name of a trial: that of its file or, for photo.* and trial.toml, of its folder."""
    stem = file.resolve().parent.name if file.stem in ("photo", "trial") else file.stem
    return LINE_BREAKING.sub("-", stem)[:80].strip() or "trial"


def seen_from(folder: Path, settings: SettingValues, source: Path = Path()) -> dict[str, Any]:
    """Return settings in which paths are relative to ``folder``, the folder of the trial, instead of ``source``.

    Trial and files can then be moved together, and the paths do not contain the user's name.
    """
    return {name: _seen_from(folder, value, source) for name, value in settings.items()}


def _seen_from(folder: Path, value: Any, source: Path) -> Any:
    if isinstance(value, dict):
        return seen_from(folder, value, source)
    if not isinstance(value, Path):
        return value
    file = source / value
    try:
        # Links are resolved, because ".." leads from a link to the folder above its target.
        return Path(os.path.relpath(file.parent.resolve() / file.name, folder.resolve())).as_posix()
    except ValueError:
        # On Windows, a file on another drive has no relative path.
        return file.absolute().as_posix()


IN_PLACE_OF = {
    **{f"fluid.{key}": [f"fluid.{name}" for name in excluded_by(key)] for key in LAWS if key != "material"},
    "path.volume_ml": ["path.weighed", "path.fill"],
}
"""Settings that are removed from a trial when the key is set: settings of other flow laws, or of another volume."""


def with_settings(content: Mapping[str, Any], settings: SettingValues) -> dict[str, Any]:
    """Return the tables of a trial with ``settings`` by dotted name, and without the settings that they exclude."""
    changed = dict(content)
    for name, value in settings.items():
        *tables, key = name.split(".")
        home = changed
        for table in tables:
            home[table] = dict(inner) if isinstance(inner := home.get(table), dict) else {}
            home = home[table]
        home[key] = value
        others = [other for other in IN_PLACE_OF.get(name, ()) if value is not None and other.partition(".")[2] in home]
        # D, the drag of the walls, was fitted together with U, so it is removed with U.
        others += ["fluid.D_cm"] * ("fluid.U" in others)
        for other in set(others) - set(settings):
            home.pop(other.partition(".")[2], None)
    if isinstance(named := changed.get("assumed"), list | tuple):
        changed["assumed"] = [name for name in named if name not in settings]
    return changed


def replaced(trial: Trial, settings: SettingValues, names: Iterable[str]) -> list[str]:
    """Return the names in ``settings`` that would be removed from a trial if all settings in ``names`` were given."""
    content = trial.content
    removed = names_in(content) - names_in(with_settings(content, dict.fromkeys(names, 0)))
    return [name for name in settings if ".".join(name.split(".")[:2]) in removed]


def names_in(content: Mapping[str, Any]) -> set[str]:
    """Return the dotted names of the settings in the tables of a trial."""
    return {f"{table}.{key}" for table, inner in content.items() if isinstance(inner, dict) for key in inner}


def trial_text(content: Mapping[str, Any]) -> str:
    """Return the tables of a trial as TOML."""
    import tomlkit

    document = tomlkit.document()
    document.add(tomlkit.comment("Written by sealtwin: all settings of this run, including defaults."))
    for key, value in content.items():
        document.add(key, value)
    return tomlkit.dumps(document)


def sets_resolution(names: Iterable[str]) -> bool:
    """Return True if ``names`` contains a setting of the solver that a draft would change."""
    return any(name.startswith("solver.") and name not in OF_ANY_DRAFT for name in names)


def drafted(trial: Trial, sample: Sample) -> Trial:
    """Return a trial with the preset "draft", and with the settings that its run derives from it.

    A trial of the fast model, or with another preset than "accurate", is returned unchanged.
    """
    if not trial.solver.has_particles or trial.solver.preset != "accurate":
        return trial
    changes = {"preset": "draft", "substeps": None, "iterations": None}
    return as_run(trial.model_copy(update={"solver": trial.solver.model_copy(update=changes)}), sample)


def as_run(trial: Trial, sample: Sample) -> Trial:
    """Return a trial with the nozzle, the particle radius, U and D of its run.

    Raises InputError if the trial has no fluid.
    """
    from simulate.setup_checks import resolved

    nozzle = trial.nozzle.over(sample.outline.mean_width_mm)
    fluid, solver = resolved(sample, trial.given_fluid, trial.solver, nozzle)
    return trial.model_copy(update={"fluid": fluid, "solver": solver, "nozzle": nozzle})
