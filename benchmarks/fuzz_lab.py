"""The small lab that every case gets a copy of: photos, trials, sheets, a run, a study, a catalogue and a plan."""

import shlex
import shutil
from pathlib import Path

import ezdxf
import ezdxf.filemanagement
from ezdxf import units

from benchmarks.fuzz_process import in_a_process
from tests.support.lab_folder import DEFAULTS, ENDS
from tests.support.photos import mortar, with_crack, write_png
from tests.support.tiny_study import TRIAL, plannable_lab

PLAN = "plan planned.toml --knots 3 --verify 1 --seeds 1 --device cpu --quiet"
HEIC = Path(__file__).parents[1] / "fixtures" / "heic" / "crack.heic"
MESHES = ("stl", "ply", "glb")
ACCEPTED = (0, 5)
MINE = {
    "notes.txt": "mine",
    ".notes.2024.txt": "mine too",
    "run/.crack.12345.stl": "mine as well",
    "run/remark.md": "m",
}
"""Files of the user's that no command is told of."""
MADE_BY = (
    "run trial.toml --device cpu --quiet --out run",
    "robot run --cell cell.toml --quiet",
    f"{PLAN} --out plan",
    "sweep study.toml --out study --device cpu --jobs 1 --quiet",
    "map study --any-volume --quiet",
    "ingest photos --out ingested --quiet",
)
"""Commands that make the folders of the lab."""


def sound_lab(folder: Path) -> None:
    """Write the lab. Raises RuntimeError if one of its commands is refused."""
    import trimesh

    plannable_lab(folder)
    # Its time and its identifier would move what a case damages.
    ezdxf.options.write_fixed_meta_data_for_testing = True  # pyright: ignore[reportPrivateImportUsage]
    drawing = ezdxf.filemanagement.new(units=units.MM)
    for layer, y in (("LOWER", 0), ("UPPER", 3)):
        drawing.modelspace().add_lwpolyline([(0, y), (20, y + 1), (40, y)], dxfattribs={"layer": layer})
    drawing.modelspace().add_spline([(0, 1.5, 0), (20, 2.5, 0), (40, 1.5, 0)], dxfattribs={"layer": "MIDDLE"})
    drawing.saveas(folder / "crack.dxf")
    (folder / "trial.toml").write_text(TRIAL + "\n[output]\nsnapshots_s = []\n")
    # Beside trial.toml it is refused for its name, when both are read.
    (folder / "twin.toml").write_text(TRIAL.replace("calibrated-on", "held-out"))
    (folder / "fill.csv").write_text("mass_g,level_mm\n0.10,-4\n0.17,-2\n0.25,0\n")
    filled = TRIAL.replace('tilt = "vertical"', 'tilt = "flare"\nfill = "fill.csv"')
    (folder / "filled.toml").write_text(filled + "\n[output]\nsnapshots_s = []\n")
    photos = folder / "photos"
    photos.mkdir()
    # Longer than that of trial.toml: nobody gives its ends.
    longer = with_crack(mortar((400, 200)), [(10, 101), (80, 75), (150, 110), (220, 80), (300, 115), (390, 90)], 20)
    write_png(photos / "P01.png", longer)
    shutil.copy(folder / "readings.csv", photos / "P01.csv")
    (photos / "lab.toml").write_text(DEFAULTS.replace(f"ends_px = {ENDS}", "crack = 1"))
    shutil.copy(HEIC, folder / "phone.heic")
    for line in MADE_BY:
        call_here(folder, line)
    shutil.copytree(folder / "run", folder / "twin")
    mesh = trimesh.load_mesh(folder / "run" / "crack.stl")
    # As it is, the crack is shorter than the trims of a path.
    mesh.apply_scale(10.0)
    for kind in MESHES:
        mesh.export(folder / f"block.{kind}")
    for name, text in MINE.items():
        (folder / name).write_text(text)


def call_here(folder: Path, line: str) -> None:
    exit_code, output, _ = in_a_process(shlex.split(line), folder)
    if exit_code not in ACCEPTED:
        raise RuntimeError(f"{line}: {exit_code}: {output}")
