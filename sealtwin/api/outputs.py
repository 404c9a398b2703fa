"""Output files: robot programs, and the report as page, PDF and JSON. The commands write the same report."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from digitise.robots.cell import ProgramOptions
from sealtwin.api import FilePath, of_one_crack, require_kinds, settings_from
from sealtwin.api.levels import LevelComparison, LevelReadings
from sealtwin.api.runs import PlannedPath, SimulatedLevel
from sealtwin.api.samples import CrackOutline
from sealtwin.core import files
from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline, Run, Solid, Trajectory
from sealtwin.core.run_folder import MANIFEST, require_folder, versions
from sealtwin.core.settings_text import keywords_of
from sealtwin.trial.job import NUMBERS, OVERLAY, STRAIGHT


def write_report(
    folder: FilePath,
    crack: CrackOutline,
    solid: Solid,
    path: PlannedPath,
    run: Run | SimulatedLevel,
    result: LevelComparison | None = None,
    *,
    name: str | None = None,
    note: str = "",
) -> Path:
    """Write report.html, report.pdf, report.json and overlay.png, as ``sealtwin run`` does.

    Parameters
    ----------
    folder
        Folder for the files; files of an earlier call are replaced.
    crack, solid, path, run, result
        Results of the other functions; ``run`` may be the level of ``fill_fast``. Without ``result`` the report shows
        only the simulation.
    name, note
        Title of the report (default: the folder's name), and a text with what a reader must know about this trial.

    Returns
    -------
    Path
        The page, report.html.

    Raises
    ------
    InputError
        ``result`` compares another level than that of ``run``; ``path`` is not from ``plan_path``, or ``crack`` not
        from ``trace_crack`` or ``import_mesh``; or the folder is a run folder, whose report 'sealtwin validate' writes.

    Examples
    --------
    ``crack``, ``solid``, ``path``, ``level`` and ``result`` are those of ``fill_fast`` and ``compare``.

    >>> page = st.write_report("report", crack, solid, path, level, result)
    >>> page.name
    'report.html'
    """
    from digitise.trajectory import with_path
    from digitise.walls.overlay import draw_overlay, straight_view
    from simulate.profile import measure_profile, volume_ratio
    from validate.compare import assess
    from validate.report.write_report import REPORT
    from validate.report.write_report import write_report as write_pages
    from validate.result import Evidence, ReadingsSheet, provenance

    run = run.run if isinstance(run, SimulatedLevel) else run
    require_kinds("write_report", crack=(crack, CrackOutline), path=(path, PlannedPath), run=(run, Run))
    compared = [] if result is None else [result.level, result.readings]
    of_one_crack("write_report", crack, solid, path, run, *compared)
    target = Path(folder)
    require_folder(target)
    if (target / MANIFEST).is_file():
        raise InputError(f"{target} is a run folder: 'sealtwin validate' writes its report. Give another folder.")
    profile = measure_profile(run, crack, solid)
    if result is not None and not np.array_equal(result.level.level_mm, profile.level_mm):
        raise InputError("write_report: result is a comparison of another run's level; give the run that was compared.")
    readings = None if result is None else result.readings
    sheet, hashes = None, {crack.photo.file.name: crack.sha256}
    if isinstance(readings, LevelReadings):
        sheet = ReadingsSheet(name=readings.source, sha256=readings.sha256, operator=None, date=None)
        hashes[readings.source] = readings.sha256
    facts = {name: f"sha256 {digest}" for name, digest in hashes.items()}
    facts["written"] = datetime.now(UTC).isoformat(timespec="seconds")
    target.mkdir(parents=True, exist_ok=True)
    files.write_png(target / OVERLAY, draw_overlay(crack.photo, crack, path))
    files.write_png(target / STRAIGHT, straight_view(crack.photo, crack))
    evidence = Evidence(
        name=name or target.resolve().name,
        note=note,
        outline=crack,
        solid=with_path(solid, path, crack, path.settings),
        trajectory=path,
        run=run,
        profile=profile,
        readings=readings,
        volume_ratio=float(run.health.volume_ratio or volume_ratio(run, solid)),
        overlay_path=target / OVERLAY,
        straight_path=target / STRAIGHT,
        photo_data=crack.data,
        provenance=provenance(facts, run.device, run.settings.get("seed"), versions(), NUMBERS),
        sheet=sheet,
    )
    if result is not None:
        comparison = assess(evidence, result.settings, result.declared, None, result.gate)
        evidence = replace(evidence, comparison=comparison)
    write_pages(target, evidence)
    return target / REPORT[0]


@keywords_of(ProgramOptions)
def write_robot_program(
    folder: FilePath,
    crack: Outline,
    path: Trajectory,
    cell: FilePath | Mapping[str, Any],
    *,
    formats: Sequence[str] | None = None,
    name: str = "",
    allow_automatic: bool | None = None,
) -> list[Path]:
    """Write a nozzle path as robot programs, in the robot's frame and checked against its cell's limits.

    Parameters
    ----------
    folder
        Folder for the files; files that were edited since they were written are not replaced.
    crack, path
        The crack and its path.
    cell
        A cell file, or its content as a mapping: taught points, limits, languages. ``sealtwin robot --example FILE``
        writes one to start from.
    name
        Name of the trial in the head of each program.

    Returns
    -------
    list of Path
        The files written; the last one, robot.json, states frame, limits and hashes.

    Raises
    ------
    InputError
        The cell has a fault or no table for a format, the path exceeds one of the cell's limits, or the crack was found
        automatically and is not confirmed.

    Examples
    --------
    ``crack`` and ``path`` are those of ``plan_path``. 'sealtwin robot --example cell.toml' writes a cell file.

    >>> files = st.write_robot_program("robot", crack, path, "cell.toml", formats=["csv"])
    >>> [file.name for file in files]
    ['path.csv', 'robot.json']
    """
    options = settings_from(ProgramOptions, "write_robot_program", locals())
    from sealtwin.trial.exports import REPORT, CellFile, require_confirmed, write_programs

    of_one_crack("write_robot_program", crack, path)
    require_confirmed("write_robot_program", crack, options)
    origin = {
        "trial": name or "not named",
        "run": "from Python",
        "path_source": crack.path_source,
        "inputs": {},
        "edited_by_hand": [],
    }
    target = Path(folder)
    read = CellFile.read(cell if isinstance(cell, Mapping) else Path(cell))
    report, _ = write_programs(target, path, read, options, origin)
    return [*(target / file for file in report["files"]), target / REPORT]
