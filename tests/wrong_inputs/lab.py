"""Wrong texts and folders of a lab."""

from collections.abc import Callable, Sequence
from pathlib import Path

import cv2

from tests.support.photos import mortar, with_crack, write_png
from tests.wrong_inputs.table import WrongInput, answers

ENDS_PX = "[[20.0, 41.0], [140.0, 38.0]]"
LAB = f"""\
data = "synthetic"
[photo]
mm_per_px = 0.1
ends_px = {ENDS_PX}
[crack]
depth_mm = 16.0
tilt = "vertical"
[path]
volume_ml = 0.08
speed_mm_s = 20.0
trim_mm = 1.0
[nozzle]
diameter_mm = 1.2
[solver]
model = "slot"
"""
"""Settings of all samples: and the fast model, which is checked quickly."""
NONE_SOUND, SOME_FAILED = 3, 6
INGEST = "ingest {given}/folder --out {out} --dry-run --quiet"


ingested = answers(INGEST)


def _folder(path: Path, lab: str = LAB, samples: Sequence[int] = (3,), **texts: str) -> None:
    """Write photos, N3 and N4, lab.toml, and texts by their names, with __ for the point."""
    folder = path / "folder"
    folder.mkdir()
    for number in samples:
        image = with_crack(mortar((160, 80), seed=number), [(20, 41), (60, 38), (140, 38)], 14)
        write_png(folder / f"N{number}.png", image)
    (folder / "lab.toml").write_text(lab)
    for name, text in texts.items():
        (folder / name.replace("__", ".")).write_text(text, encoding="utf-8")


def _files(lab: str = LAB, samples: Sequence[int] = (3,), **texts: str) -> Callable[[Path], None]:
    return lambda path: _folder(path, lab, samples, **texts)


def _beside_markers(path: Path) -> None:
    """Draw four markers of 40 px around a crack: 0.4 mm/px if they are 16 mm wide."""
    brightness = with_crack(mortar((420, 260)), [(100, 130), (320, 132)], 14)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    for number, (x, y) in enumerate([(20, 20), (360, 20), (20, 200), (360, 200)]):
        brightness[y - 12 : y + 52, x - 12 : x + 52] = 0.9
        marker = cv2.aruco.generateImageMarker(dictionary, number, 36)
        brightness[y : y + 40, x : x + 40] = cv2.resize(marker, (40, 40), interpolation=cv2.INTER_NEAREST) / 255 * 0.9
    write_png(path / "photo.png", brightness)


OFFERED = ("[photo.markers]", "4 markers of 4x4_50", "sealtwin markers --face-mm", "--toml")
SHEET = "s [mm];level [mm]\n1;-1,5\n5;-1,4\n9;-1,6\n"
TWO_TABLES = "N3;;;Z9;\ns [mm];level [mm];;s [mm];level [mm]\n1;-1,5;;1;2,5\n9;-1,4;;9;2,6\n"
OF_SHEET = LAB + '[readings]\nrole = "held-out"\n'
NOT_SAID = LAB.replace("0.1", "0.5").partition("[path]")[0] + '[solver]\nmodel = "slot"\n'

# fmt: off
CASES: list[WrongInput] = [
    ingested("a text with a depth", _files(N3__txt="Tiefe ca. 9-11 mm"), "Not used: N3.txt: this", code=0),
    ingested("a title above a sheet says another depth than lab.toml",
        _files(OF_SHEET, N3__csv=f"Risstiefe;9 mm\n{SHEET}"), "remark", "A1 has the remark 'Risstiefe 9 mm'", code=0),
    ingested("samples in the columns of a sheet that is called as one of them",
        _files(OF_SHEET, (3, 4), N3__csv="s [mm];Probe 1 Tiefe [mm];Probe 2 Tiefe [mm]\n1;1,5;2,5\n9;1,4;2,4\n"),
        "N3.csv", "'Probe 1 Tiefe [mm]'", "levels", code=SOME_FAILED),
    ingested("tables of two samples beside each other, one without a photo",
        _files(OF_SHEET, N3__csv=TWO_TABLES), "N3.csv", "range = ...", code=NONE_SOUND),
    ingested("settings in a file of their own", _files(N3__toml="crack.depth_mm = 9.0"), "Not used: N3.toml",
        "columns of pairing.csv, such as crack.depth_mm", code=0),
    ingested("path and nozzle without settings", _files(NOT_SAID), "filled fraction of the cavity 0.6",
        "crack's ends 5 mm", "speed of the nozzle 4 mm/s", "diameter of the nozzle auto", code=0),
    answers("quick {given}/photo.png --depth-mm 16 --out {out}")("no scale, but markers in the photo",
        _beside_markers, *OFFERED),
    ingested("no scale, but markers in the photo", lambda path: (_folder(path, LAB.replace("mm_per_px = 0.1", ""), ()),
        _beside_markers(path), (path / "photo.png").rename(path / "folder" / "N3.png")), "photo.mm_per_px is missing",
        *OFFERED, code=NONE_SOUND),
]
# fmt: on
