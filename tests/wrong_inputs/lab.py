"""A lab's notes and folders."""

from collections.abc import Callable
from pathlib import Path

from tests.pictures import mortar, with_crack, write_png
from tests.wrong_inputs.table import WrongInput

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
SOME_FAILED = 6
WITH_NOTE = "ingest {given}/folder --pairing {given}/pairing.csv --out {out} --dry-run --quiet"


def _folder(place: Path, lab: str = LAB, **texts: str) -> None:
    """Write two photos, N3 and N4, lab.toml, and texts by their names, with __ for the point."""
    folder = place / "folder"
    folder.mkdir()
    for number in (3, 4):
        image = with_crack(mortar((160, 80), seed=number), [(20, 41), (60, 38), (140, 38)], 14)
        write_png(folder / f"N{number}.png", image)
    (folder / "lab.toml").write_text(lab)
    for name, text in texts.items():
        (folder / name.replace("__", ".")).write_text(text, encoding="utf-8")


def _with_note(text: str, settings: str = "", skip: str = "") -> Callable[[Path], None]:
    def make(place: Path) -> None:
        _folder(place, N3__txt=text)
        row = f'N3.txt,note,N3,"{skip}","{settings}"'
        (place / "pairing.csv").write_text(f"file,role,sample,skip,settings\n{row}\n", encoding="utf-8")

    return make


def _read(text: str, *names: str) -> WrongInput:
    said = names or ("crack.depth_mm = 9.0",)
    return WrongInput(f"the note {text!r} is read", _with_note(text), WITH_NOTE, said, 0, ("no setting was read",))


def _asked(text: str, *names: str) -> WrongInput:
    told = ("N3.txt", "no setting was read", *names)
    return WrongInput(f"the note {text!r} is asked about", _with_note(text), WITH_NOTE, told, SOME_FAILED)


CASES: list[WrongInput] = [
    _read("depth = 9 mm"),
    _read("Sample N3: depth = 9 mm"),
    _read("Sample N3: depth = 9 mm. scale 0.1 mm/px.", "crack.depth_mm = 9.0", "photo.mm_per_px = 0.1"),
    _read("Tiefe ca. 9 mm"),
    _read("9 mm tief"),
    _read("Tiefe: 9,0 mm"),
    _read("9 mm deep"),
    _read("t = 0.9 cm"),
    _asked("9-11 mm", "9-11 mm"),
    _asked("depth at left 9 mm, at right 14 mm", "9 mm; 14 mm"),
]
