"""A lab's notes and folders."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2

from tests.pictures import mortar, with_crack, write_png
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
"""Of all samples: a depth that a note of one must not leave standing, and the fast model, which is checked soon."""
NONE_SOUND, SOME_FAILED = 3, 6
WITH_NOTE = "ingest {given}/folder --pairing {given}/pairing.csv --out {out} --dry-run --quiet"


noted = answers(WITH_NOTE)


def _folder(place: Path, lab: str = LAB, samples: Sequence[int] = (3,), **texts: str) -> None:
    """Write photos, N3 and N4, lab.toml, and texts by their names, with __ for the point."""
    folder = place / "folder"
    folder.mkdir()
    for number in samples:
        image = with_crack(mortar((160, 80), seed=number), [(20, 41), (60, 38), (140, 38)], 14)
        write_png(folder / f"N{number}.png", image)
    (folder / "lab.toml").write_text(lab)
    for name, text in texts.items():
        (folder / name.replace("__", ".")).write_text(text, encoding="utf-8")


def _with_note(text: str, settings: str = "", skip: str = "", samples: Sequence[int] = (3,)) -> Callable[[Path], None]:
    def make(place: Path) -> None:
        _folder(place, samples=samples, N3__txt=text)
        row = f'N3.txt,note,N3,"{skip}","{settings}"'
        (place / "pairing.csv").write_text(f"file,role,sample,skip,settings\n{row}\n", encoding="utf-8")

    return make


def _read(text: str, *names: str, **others: Any) -> WrongInput:
    settings = names or ("crack.depth_mm = 9.0",)
    row = noted(f"the note {text!r} is read", _with_note(text), *settings, lacks=("no setting was read",), **others)
    return replace(row, code=0)


def _asked(text: str, *names: str, **others: Any) -> WrongInput:
    words = ("N3.txt", "no setting was read", *names)
    return noted(f"the note {text!r} is asked about", _with_note(text), *words, code=NONE_SOUND, **others)


def _files(lab: str = LAB, samples: Sequence[int] = (3,), **texts: str) -> Callable[[Path], None]:
    return lambda place: _folder(place, lab, samples, **texts)


def _named(name: str) -> Callable[[Path], None]:
    def make(place: Path) -> None:
        _folder(place)
        (place / "folder" / "N3.png").rename(place / "folder" / name)

    return make


def _blurred(place: Path) -> None:
    """A photo without a crack: its trial is refused, with a picture that a dry run forgets."""
    _folder(place)
    write_png(place / "folder" / "N3.png", mortar((160, 80)))


def _beside_markers(place: Path) -> None:
    """Draw four markers of 40 px around a crack: 0.4 mm/px if they are 16 mm wide."""
    brightness = with_crack(mortar((420, 260)), [(100, 130), (320, 132)], 14)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    for number, (x, y) in enumerate([(20, 20), (360, 20), (20, 200), (360, 200)]):
        brightness[y - 12 : y + 52, x - 12 : x + 52] = 0.9
        marker = cv2.aruco.generateImageMarker(dictionary, number, 36)
        brightness[y : y + 40, x : x + 40] = cv2.resize(marker, (40, 40), interpolation=cv2.INTER_NEAREST) / 255 * 0.9
    write_png(place / "photo.png", brightness)


INGEST = "ingest {given}/folder --out {out} --dry-run --quiet"
ON_PAPER = (
    "digitise {given}/photo.png --depth-mm 16 --ends 100,130 320,132 --set crack.tilt=vertical --out {out} --mm-per-px"
)
ingested, typed = answers(INGEST), answers(ON_PAPER)
SHEET = "s [mm];level [mm]\n1;-1,5\n5;-1,4\n9;-1,6\n"
TWO_TABLES = "N3;;;Z9;\ns [mm];level [mm];;s [mm];level [mm]\n1;-1,5;;1;2,5\n9;-1,4;;9;2,6\n"
OF_SHEET = LAB + '[readings]\nrole = "held-out"\n'
NOT_SAID = LAB.replace("0.1", "0.5").partition("[path]")[0] + '[solver]\nmodel = "slot"\n'
OTHERS = "Luftdruck 100 kPa. Viskositaet 54 cP. Duese 3 mm vor der Kante. tilt angle 12 deg. flow 400 mm3/s"

# fmt: off
CASES: list[WrongInput] = [
    _read("depth = 9 mm", broad=True),
    _read("Sample N3: depth = 9 mm", broad=True),
    _read("Sample N3: depth = 9 mm. scale 0.1 mm/px.", "crack.depth_mm = 9.0", "photo.mm_per_px = 0.1", broad=True),
    _read("Tiefe ca. 9 mm"),
    _read("9 mm tief", broad=True),
    _read("Tiefe: 9,0 mm", broad=True),
    _read("9 mm deep", broad=True),
    _read("t = 0.9 cm"),
    _asked("9-11 mm", "9-11 mm", broad=True),
    _asked("depth at left 9 mm, at right 14 mm", "9 mm; 14 mm", broad=True),
    _asked("21 °C, 14:30 Uhr, am 3.5.2026, 12 g", "21 °C; 14:30 Uhr; 3.5.2026; 12 g", broad=True),
    _asked("Dichtstoff 3 mm tief", "3 mm", broad=True),
    _asked("Tiefe 9 mm. Depth = 14 mm", "9 mm; 14 mm"),
    _asked("Tiefe 9", "Tiefe 9", broad=True),
    _asked("max. Tiefe 9 mm", "9 mm", broad=True),
    _asked(OTHERS, "100 kPa; 54 cP; 3 mm; 12 deg; 400 mm3/s", broad=True),
    _asked("Zustand: halb trocken", "Zustand: halb trocken"),
    *(
        ingested(f"the cell {cell!r} of a note is read", _files(N3_notes__csv=f"Tiefe;{cell}\nBediener;M\n"), *names,
            code=code, broad=cell not in {"etwa 0,9 cm gemessen", "max. 9 mm"})
        for cell, names, code in (
            ("ca. 9 mm", ("read as crack.depth_mm = 9.0 (ca. 9 mm)",), 0),
            ("~9 mm", ("read as crack.depth_mm = 9.0 (~9 mm)",), 0),
            ("etwa 0,9 cm gemessen", ("read as crack.depth_mm = 9.0 (etwa 0,9 cm gemessen)",), 0),
            ("ca. 0.5 in", ("read as crack.depth_mm = 12.7 (ca. 0.5 in)",), 0),
            ("max. 9 mm", ("N3_notes.csv, line 1", "'max. 9 mm'"), NONE_SOUND),
            ("9 mm ± 1", ("N3_notes.csv, line 1", "'9 mm ± 1'"), NONE_SOUND),
            ("ca. 9", ("N3_notes.csv, line 1", "'ca. 9' has no unit"), NONE_SOUND),
        )
    ),
    noted("a note that names another sample too", _with_note("N3: Tiefe 9 mm. N4: Tiefe 14 mm", samples=(3, 4)),
        "N3.txt", "N4", "role text", code=SOME_FAILED, lacks=("crack.depth_mm = 9",)),
    noted("a number of a note that the user says is for nobody",
        _with_note("Tiefe 9 mm. 21 °C um 14:30", skip="14:30; 21 °C"), "crack.depth_mm = 9.0", code=0,
        lacks=("no setting was read",)),
    noted("a number of a note that the user says is a setting",
        _with_note("am Rand 9 mm, Mitte 14 mm", settings="crack.depth_mm = [[0, 9], [10, 14]]"), "N3.txt", code=0,
        lacks=("no setting was read",)),
    ingested("a text before anybody calls it a note names what it would leave open",
        _files(N3__txt="depth = 9 mm. Am 3.5.2026 bei 21 °C, links 12 mm"), "N3.txt", "crack.depth_mm = 9.0",
        "3.5.2026; 21 °C; 12 mm", "role to note", code=0, broad=True),
    ingested("a text of several samples is not left out in silence",
        _files(samples=(3, 4), notes__md="N3: Tiefe 9 mm. N4: Tiefe 14 mm."), "notes.md", "names N3, N4",
        "9 mm; 14 mm", "role ignore", code=SOME_FAILED, broad=True),
    ingested("a text of no sample says a setting", _files(README__txt="Nozzle 1.1 mm"), "README.txt",
        "nozzle.diameter_mm = 1.1", "role ignore", code=SOME_FAILED),
    ingested("a title above a sheet says another depth than lab.toml",
        _files(OF_SHEET, N3__csv=f"Risstiefe;9 mm\n{SHEET}"), "N3.csv, row 1", "crack.depth_mm = 9.0", "lab.toml",
        "16.0", code=NONE_SOUND),
    ingested("a title above a sheet says a date, on which no run depends",
        _files(OF_SHEET, N3__csv=f"Datum 3.5.2026\n{SHEET}"), "1 of 1 sample is sound", code=0,
        lacks=("no note says so",)),
    ingested("samples in the columns of a sheet that is called as one of them",
        _files(OF_SHEET, (3, 4), N3__csv="s [mm];Probe 1 Tiefe [mm];Probe 2 Tiefe [mm]\n1;1,5;2,5\n9;1,4;2,4\n"),
        "N3.csv", "'Probe 1 Tiefe [mm]', 'Probe 2 Tiefe [mm]'", "levels", code=SOME_FAILED),
    ingested("tables of two samples beside each other, one without a photo",
        _files(OF_SHEET, N3__csv=TWO_TABLES), "N3.csv, D1:E4", "Z9", code=SOME_FAILED, broad=True),
    ingested("a sheet's depths of the crack beside another depth in lab.toml",
        _files(OF_SHEET, N3__csv=TWO_TABLES.replace("Z9", "").replace("level [mm]\n", "Risstiefe [mm]\n")),
        "N3.csv, range D2:E4", "lab.toml has 16.0", "crack.depth_mm = [[1.0, 2.5], [9.0, 2.6]]", code=NONE_SOUND),
    ingested("a note in place of lab.toml", _files(N3__toml="crack.depth_mm = 9.0"),
        "N3.toml: crack.depth_mm = 9.0, in place of 16.0 in lab.toml", code=0, broad=True),
    ingested("a key of a note without its table", _files(N3__toml="depth_mm = 9.0"), "N3.toml",
        "'depth_mm' = 9.0 may be crack.depth_mm", code=NONE_SOUND),
    ingested("a misspelt word of a note, whose depth lab.toml would replace",
        _files(N3_notes__csv="Risstife;9 mm\nBediener;M\n"), "N3_notes.csv",
        "'Risstife' = '9 mm' may be crack.depth_mm", code=NONE_SOUND, broad=True),
    ingested("a depth in a photo's name", _named("N3 9mm.png"), "N3 9mm.png", "its name has 9mm", code=0),
    ingested("path and nozzle that nobody said", _files(NOT_SAID), 'path.volume_ml = "cavity"', "path.trim_mm = 10.0",
        "path.speed_mm_s = 4.0", "nozzle.diameter_mm = 2.4", code=0, broad=True),
    answers(INGEST.replace(" --quiet", ""))("a picture in a folder that a dry run forgets", _blurred, "N3.png",
        code=SOME_FAILED, lacks=("refused.png", "inputs/photo")),
    typed("a typed scale that markers in the photo contradict", _beside_markers, "4 markers of 4x4_50",
        "0.4 mm/px, 20.0% below photo.mm_per_px = 0.5", "20.0 mm wide", "photo.markers", more=" 0.5", code=0),
    typed("a typed scale beside markers that agree", _beside_markers, "4 markers of 4x4_50", "0.4 mm/px, 0.0%",
        "photo.markers", more=" 0.4", code=0, lacks=("measure one",), broad=True),
]
# fmt: on
