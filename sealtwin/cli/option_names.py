"""Sentences about a photo or a mesh given with options: they name those in place of a trial file's settings."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from sealtwin.core.errors import InputError
from sealtwin.core.progress import Progress

OPTIONS = {
    "photo.file": "PHOTO",
    "photo.data": "--data",
    "mesh.file": "MESH",
    "photo.mm_per_px": "--mm-per-px",
    "photo.scale_is": "--assumed",
    "photo.markers": "--markers",
    "photo.face_mm": "--face-mm",
    "photo.face_corners_px": "--face-corners",
    "photo.ruler_px": "--ruler",
    "photo.ruler_mm": "--ruler-mm",
    "photo.ends_px": "--ends",
    "photo.crack": "--crack",
    "photo.via_px": "--via",
    "photo.roi_px": "--roi",
    "photo.mask": "--mask",
    "photo.second_photo": "--second-photo",
    "photo.edge_fraction": "--edge-fraction",
    "photo.branches": "--keep-branches",
    "photo.width_mm": "--width-mm",
    "photo.path_only": "--path-only",
    "crack.depth_mm": "--depth-mm",
    "crack.tilt": "--tilt",
    "crack.wall_angle_deg": "--wall-angle-deg",
    "path.volume_ml": "--volume-ml",
    "mesh.units": "--units",
    "mesh.up": "--up",
    "mesh.path": "--path",
    "mesh.data": "--data",
    "mesh.base_mm": "--base-mm",
}
"""Option of 'digitise' or 'import-mesh' for each setting that has one."""
NAME = r"(?P<table>photo|crack|mesh|path)\.(?P<dotted>[a-z]\w*)|(?P<bare>[a-z]+(?:_[a-z]+)+|branches(?= =))"
SETTING = re.compile(
    rf"\[photo\.markers\]|\[(?P<only>photo|crack|mesh)\]|(?<![\w-])(?:{NAME})\b(?P<value> = \"?[\w.+-]+\"?)?"
)
ELSEWHERE = "'sealtwin init DIR' writes a trial file."


def in_options(sentence: str) -> str:
    """Return a sentence with options in place of settings; a setting without one is said to be a trial file's."""
    left = list[str]()

    def named(found: re.Match[str]) -> str:
        if found[0].startswith("["):
            return "--markers" if found["only"] is None else f"the options of the {found['only']}"
        key = found["dotted"] or found["bare"]
        homes = [table for table in _tables_with(key) if found["table"] in (None, table)]
        value = found["value"] or ""
        for option in (OPTIONS[name] for home in homes if (name := f"{home}.{key}") in OPTIONS):
            return (
                option
                if option in ("--keep-branches", "--assumed", "--path-only")
                else option + value.replace(" =", "")
            )
        if not homes:
            return found[0]
        left.append(key)
        return f"{homes[0]}.{key} of a trial file{value}"

    told = SETTING.sub(named, sentence)
    return f"{told.removesuffix('.')}. {ELSEWHERE}" if left else told


def _tables_with(key: str) -> list[str]:
    from digitise.settings import CrackShape, MeshInput, NozzlePath, PhotoInput

    tables = {"photo": PhotoInput, "crack": CrackShape, "mesh": MeshInput, "path": NozzlePath}
    return [name for name, table in tables.items() if key in table.model_fields]


class OptionProgress(Progress):
    """Progress whose notes and warnings name options."""

    def __init__(self, shown: Progress) -> None:
        self._shown = shown
        self.start, self.expect, self.advance, self.close = shown.start, shown.expect, shown.advance, shown.close

    def note(self, text: str) -> None:
        self._shown.note(in_options(text))

    def warn(self, text: str) -> None:
        self._shown.warn(in_options(text))


@contextmanager
def options_named() -> Iterator[None]:
    """Let an InputError from within name options."""
    try:
        yield
    except InputError as fault:
        raise type(fault)(in_options(str(fault))) from None
