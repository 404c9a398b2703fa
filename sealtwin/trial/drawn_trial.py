"""Make the trial of a crack from a CAD drawing: its mesh, its line, and a trial file that names both."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sealtwin.core import files
from sealtwin.core.arc_length import arc_length
from sealtwin.core.run_folder import require_folder
from sealtwin.core.settings import checked
from sealtwin.trial.trial_file import Trial, name_of, trial_text, with_settings

MESH, LINE, TRIAL = "drawing.obj", "line.csv", "trial.toml"
"""Files of the trial of a drawn crack."""


def write_drawn_trial(
    drawing: Path, folder: Path, depth_mm: float, units: Any, shown_by: dict[str, Any], settings: Mapping[str, Any]
) -> tuple[Path, list[str]]:
    """Write the mesh of a drawn crack, its centreline if it is drawn, and a trial; return the trial file and notes.

    ``shown_by`` has the layers for ``drawn_crack``, and ``settings`` has settings of the trial by dotted name. Raises
    InputError if the drawing cannot be used, or if a file of the same name exists with another content.
    """
    from digitise.drawing.drawn_block import drawn_crack
    from digitise.drawing.drawn_layers import DrawnLayers
    from digitise.drawing.read_dxf import open_drawing

    require_folder(folder)
    drawn = open_drawing(drawing, units)
    crack = drawn_crack(DrawnLayers(drawn), depth_mm, **shown_by)
    notes = [*drawn.notes, *drawn.not_read()]
    mesh = {"file": MESH, "data": "undeclared", "units": "mm"}
    contents = {folder / MESH: crack.as_obj()}
    if crack.line_mm is not None:
        rows = "".join(f"{x:.4f},{y:.4f}\n" for x, y in crack.line_mm)
        contents[folder / LINE] = f"x_mm,y_mm\n{rows}".encode()
        mesh["path"] = LINE
        notes.append(f"the drawn line is {arc_length(crack.line_mm)[-1]:.1f} mm long")
    floor = f"{depth_mm:g} mm deep, with upright walls and a level floor"
    note = f"The crack is that of the drawing {drawing.name} in {drawn.unit}, {floor}."
    content = {"name": name_of(drawing, "drawing"), "note": note, "mesh": mesh}
    trial = checked(Trial, drawing, with_settings(content, settings))
    contents[folder / TRIAL] = trial_text(trial).encode()
    files.write_unless_other(contents)
    return folder / TRIAL, notes
