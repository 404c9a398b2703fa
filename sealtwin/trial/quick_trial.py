"""Make the trials of 'sealtwin quick', whose settings are the starter's if not given, and of 'sealtwin import-dxf'."""

import hashlib
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from digitise.drawing.given import GivenDrawing
from sealtwin.core.errors import InputError
from sealtwin.core.facts import Fact
from sealtwin.core.files import write_text, write_unless_other
from sealtwin.core.plain_files import read_bytes
from sealtwin.core.records import Sample
from sealtwin.core.run_folder import require_folder
from sealtwin.core.settings import checked, doubts_of
from sealtwin.trial.starter_files import TRIAL
from sealtwin.trial.trial_file import Trial, checked_trial, name_of, names_in, seen_from, trial_text, with_settings

STARTER = tomllib.loads(TRIAL)
NOT_ASSUMED = ("crack.depth_mm", "path.flow", "path.ramp_mm", "path.lead_in_mm")
"""Settings of the starter that are not marked as assumed, since they are always given, or are defaults."""
ASSUMED = {
    f"{table}.{key}": value
    for table in ("crack", "path", "fluid", "solver", "nozzle")
    for key, value in STARTER[table].items()
    if f"{table}.{key}" not in NOT_ASSUMED
}
"""Settings that are taken from the starter if not given, by dotted name."""
QUICK = {**ASSUMED, "solver.preset": "draft"}
NOBODY = "undeclared"  # Origin of a photo, and origin and role of readings, if not declared: they validate nothing
MARK = "# Written by 'sealtwin quick', as it was while its check is "
"""First line of the file, before a hash of the others. A file that was not edited may be overwritten."""
MESH, LINE, DRAWN = "drawing.obj", "line.csv", "trial.toml"
"""Files of the trial of a drawn crack."""
HEAD = """\
# Settings marked as assumed were not given. Measure them, correct them here, and run again:
#   sealtwin run {file} --out {run}
"""


def quick_trial(photo: Path, folder: Path, settings: Mapping[str, Any], sheet: Path | None) -> tuple[str, list[str]]:
    """Return the text of a trial file in ``folder``, and its assumptions as "table.key = value".

    ``settings`` are the given ones, by dotted name. Raises InputError, naming the photo, if one cannot be used, or a
    file is missing.
    """
    for file in (photo, *([] if sheet is None else [sheet])):
        if not file.is_file():
            raise InputError(f"{file}: no such file.")
    sheets = {} if sheet is None else {"readings.file": sheet}
    if twice := sorted({"photo.file", *sheets} & settings.keys()):
        raise InputError(f"{photo}: {twice[0]} is given twice; give it once.")
    given = seen_from(folder, {"photo.file": photo, **settings, **sheets})
    defaults = {"photo.data": NOBODY, **QUICK}
    if sheet is not None:
        defaults |= {"readings.data": NOBODY, "readings.role": NOBODY}
    content = with_settings(with_settings({"name": name_of(photo, "photo")}, defaults), given)
    # A given setting also replaces those that it excludes.
    assumed = {name: value for name, value in defaults.items() if name not in given and name in names_in(content)}
    sentences = [f"{name} = {toml_value(value)}" for name, value in assumed.items()]
    content = {"note": f"Assumed, not measured or given: {', '.join(sentences)}.", **content}
    checked_trial(photo, content)
    return _text(folder, content, given, assumed), sentences


def _text(folder: Path, content: Mapping[str, Any], given: Mapping[str, Any], assumed: Mapping[str, Any]) -> str:
    head = {key: content[key] for key in ("name", "note", "seed", "seeds") if key in content}
    lines = [HEAD.format(file=(folder / "trial.toml").as_posix(), run=(folder / "run").as_posix())]
    lines += [f"{key} = {toml_value(value)}" for key, value in head.items()]
    tables = dict.fromkeys(name.partition(".")[0] for name in (*given, *assumed) if "." in name)
    for table in tables:
        lines += ["", f"[{table}]", *_rows(table, given), *(f"{row}  # assumed" for row in _rows(table, assumed))]
    text = "\n".join(lines) + "\n"
    return f"{MARK}{_check(text)}\n{text}"


def _rows(table: str, settings: Mapping[str, Any]) -> list[str]:
    """Return the lines of one table of a trial file."""
    parts = [(*name.partition(".")[::2], value) for name, value in settings.items()]
    return [f"{key} = {toml_value(value)}" for home, key, value in parts if home == table and key]


def write_quick_trial(path: Path, text: str) -> None:
    """Write the trial file. Raises InputError if the file exists and a user wrote or edited it."""
    if path.exists():
        first, _, rest = read_bytes(path).decode("utf-8", errors="replace").partition("\n")
        if first != MARK + _check(rest):
            raise InputError(
                f"{path}: written or edited by you, and not overwritten. Run 'sealtwin run {path}', or give another "
                "--out."
            )
    write_text(path, text)


def _check(content: str) -> str:
    return hashlib.sha256(content.encode()).hexdigest()[:12]


def fast_answer(trial: Trial, sample: Sample) -> str:
    """Return a line with level, underfill and overfill by the fast model, and with the reason if it is unfit.

    For a trial that the fast model cannot compute, the line has only the reason.
    """
    from sealtwin.core.run_figures import FAST
    from simulate.slot.run import pour
    from validate.metrics.volumes import fill_volumes

    trial = trial.model_copy(update={"solver": trial.solver.model_copy(update={"model": FAST})})
    try:
        run, profile = pour(trial.pour(sample))
    except InputError as fault:
        return f"The fast model cannot answer: {fault}"
    volumes = fill_volumes(profile, sample.outline, sample.solid, 0.0, sample.outline.length_mm)
    level_mm = profile.level_mm
    unfit = f" It is UNFIT for this case, so wait for the particles: {run.unfit[0]}" if run.unfit else ""
    return (
        f"By the fast model, for screening: level {level_mm.mean():.2f} mm on average, {level_mm.min():.2f} to "
        f"{level_mm.max():.2f} mm; {volumes.underfill_mm3:.0f} mm3 are missing below the face and "
        f"{volumes.overfill_mm3:.0f} mm3 are above it.{unfit}"
    )


def write_drawn_trial(
    drawing: Path, folder: Path, crack: GivenDrawing, settings: Mapping[str, Any]
) -> tuple[Path, list[Fact]]:
    """Write the mesh of a drawn crack, its centreline if it is drawn, and a trial; return the trial file and notes.

    ``settings`` has settings of the trial by dotted name. Raises InputError if the drawing cannot be used, or if a file
    of the same name exists with another content.
    """
    from digitise.drawing.read_dxf import drawn_crack, open_drawing, sample_obj
    from digitise.settings import CrackShape

    require_folder(folder)
    drawn = open_drawing(drawing, crack.units)
    depth_mm = crack.depth_mm
    outline, _ = drawn_crack(drawn, **crack.layers)
    doubts = doubts_of(CrackShape(depth_mm=depth_mm), width_mm=outline.mean_width_mm)
    notes = [*drawn.notes, *doubts]
    mesh = {"file": MESH, "data": crack.data, "units": "mm"}
    contents = {folder / MESH: sample_obj(outline, depth_mm)}
    if crack.line is not None:
        rows = "".join(f"{x:.6f},{y:.6f}\n" for x, y in outline.centreline_mm)
        contents[folder / LINE] = f"x_mm,y_mm\n{rows}".encode()
        mesh["path"] = LINE
        text = f"the drawn line is {outline.length_mm:.1f} mm long"
        notes.append(Fact("drawing.line", text, outline.length_mm, "mm"))
    floor = f"{depth_mm:g} mm deep, with upright walls and a level floor"
    note = f"The crack is that of the drawing {drawing.name} in {drawn.unit}, {floor}."
    content = {"name": name_of(drawing, "drawing"), "note": note, "mesh": mesh}
    trial = checked(Trial, drawing, with_settings(content, settings))
    contents[folder / DRAWN] = trial_text(trial).encode()
    write_unless_other(contents)
    return folder / DRAWN, notes


def toml_value(value: Any) -> str:
    """Return a value as text of a trial file."""
    import tomlkit

    if not isinstance(value, Mapping):
        return tomlkit.item(value).as_string()
    inline = tomlkit.inline_table()
    inline.update(value)
    return inline.as_string()
