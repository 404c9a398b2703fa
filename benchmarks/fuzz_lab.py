"""The small lab that every case gets a copy of: photos, trials, sheets, a run, a study, a catalogue and a plan."""

import re
import shlex
import shutil
from datetime import date
from pathlib import Path

import ezdxf
import ezdxf.filemanagement
from ezdxf import units

from benchmarks.fuzz_process import in_a_process
from sealtwin.material import material_text
from sealtwin.material.by_rheometer import FlowCurve, material_of_table
from sealtwin.trial.starter_files import CELL
from tests.support.lab_folder import DEFAULTS
from tests.support.photos import mortar, with_crack, write_png
from tests.support.spread_photos import Blob, write_sheet_table
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
    _sound_paste_and_pump(folder)
    (folder / "fill.csv").write_text("mass_g,level_mm\n0.10,-4\n0.17,-2\n0.25,0\n")
    filled = TRIAL.replace('tilt = "vertical"', 'tilt = "flare"\nfill = "fill.csv"')
    (folder / "filled.toml").write_text(filled + "\n[output]\nsnapshots_s = []\n")
    photos = folder / "photos"
    photos.mkdir()
    # Longer than that of trial.toml: nobody gives its ends.
    longer = with_crack(mortar((400, 200)), [(10, 101), (80, 75), (150, 110), (220, 80), (300, 115), (390, 90)], 20)
    write_png(photos / "P01.png", longer)
    shutil.copy(folder / "readings.csv", photos / "P01.csv")
    (photos / "P01_note.toml").write_text("photo.crack = 1\n")
    (photos / "lab.toml").write_text(DEFAULTS.replace("[crack]", "[crack]\ndepth_mm = 8.0"))
    # Long enough for the trims that quick assumes, and so shallow that its fluid takes seconds.
    wide = with_crack(mortar((300, 120)), [(20, 61), (100, 57), (180, 63), (270, 58)], 24)
    write_png(folder / "quick.png", wide)
    shutil.copy(HEIC, folder / "phone.heic")
    (folder / "depths.csv").write_text("s_mm,depth_mm\n0,3\n12,3.2\n26,2.9\n")
    (folder / "levels.csv").write_text("s_mm,level_1_mm,level_2_mm\n5,-0.4,-0.5\n10,-0.6,-0.5\n20,-0.5,-0.4\n")
    for line in MADE_BY:
        call_here(folder, line)
    shutil.copy(folder / "plan" / "plan.csv", folder / "path_table.csv")
    with_table = re.sub(
        r"(?s)\[path\].*?\n\n", '[path]\nplan = "path_table.csv"\n\n', (folder / "planned.toml").read_text()
    )
    (folder / "path_table.toml").write_text(with_table)
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


def _sound_paste_and_pump(folder: Path) -> None:
    """Write a spread with its frame, a flow curve, a material with its trial, and weighings with their cell."""
    Blob(55.0, mm_per_px=0.5).write(folder / "spread.png")
    write_sheet_table(folder / "frame.toml")
    (folder / "curve.csv").write_text("shear_rate_per_s,stress_pa\n1,12.5\n3,13.4\n10,17.2\n30,27.1\n100,62\n")
    pump = '[pump]\nfile = "pump.csv"\ndensity_kg_m3 = 1690.0\n\n[spel] '
    (folder / "pumped.toml").write_text(CELL.replace("{file}", "pumped.toml").replace("[spel] ", pump, 1))
    rows = [f"{asked},{asked * 0.0017 * 20:.4f},20,0.3" for asked in (1, 1, 1, 10, 10, 10, 3000, 3000, 3000)]
    (folder / "pump.csv").write_text("\n".join(["asked_mm3_s,weighed_g,time_s,delay_s", *rows]) + "\n")
    curve = FlowCurve(density_kg_m3=1690.0, data="synthetic", date=date(2026, 11, 21))
    (folder / "material.toml").write_text(material_text(material_of_table(folder / "curve.csv", curve).material))
    head, rest = TRIAL.split("[fluid]\n")
    fluid = 'material = "material.toml"\nfreeze_after_s = 0.5\n\n'
    content = f"{head}[fluid]\n{fluid}{rest[rest.index('[solver]') :]}\n[output]\nsnapshots_s = []\n"
    (folder / "pasted.toml").write_text(content)
