"""What a batch of photos became, for spreadsheets and for people."""

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sealtwin.store.files import write_text
from sealtwin.store.tables import write_sheet
from sealtwin.trials.sample import REFUSED

COLUMNS = (
    "file",
    "status",
    "mean_width_mm",
    "length_mm",
    "depth_mm",
    "cavity_ml",
    "sealant_ml",
    "mm_per_px",
    "scale_source",
    "path_source",
    "warnings",
    "reason",
)
THUMBNAIL_PX = 720
"""Wide enough to see the walls, small enough for a page of a hundred."""

Entry = Mapping[str, Any]


def write_csv(path: Path, photos: Sequence[Entry]) -> None:
    write_sheet(path, COLUMNS, ([_cell(photo[column]) for column in COLUMNS] for photo in photos))


def write_contact_sheet(path: Path, folder: Path, photos: Sequence[Entry]) -> None:
    """One page that needs no other file, though its pictures lead to the run folders beside it."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("sealtwin"), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    done = [photo for photo in photos if photo["status"] == "ok"]
    page = environment.get_template("contact_sheet.html.j2").render(
        photos=photos,
        thumbnails={photo["folder"]: _thumbnail(folder / photo["folder"] / "overlay.png") for photo in done},
        refused={
            photo["folder"]: _thumbnail(folder / photo["folder"] / REFUSED)
            for photo in photos
            if REFUSED in photo["reason"] and (folder / photo["folder"] / REFUSED).is_file()
        },
        done=done,
        sealant_ml=sum(photo["sealant_ml"] for photo in done),
    )
    write_text(path, page)


def _cell(value: Any) -> str | float | None:
    return "; ".join(value) if isinstance(value, tuple | list) else value


def _thumbnail(overlay: Path) -> str:
    """As a data URI."""
    import cv2
    import numpy as np

    picture = cv2.imdecode(np.frombuffer(overlay.read_bytes(), dtype=np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        raise RuntimeError(f"{overlay}: our own picture cannot be read")
    shrink = min(1.0, THUMBNAIL_PX / max(picture.shape))
    small = cv2.resize(picture, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
    encoded, jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 82])
    if not encoded:
        raise RuntimeError("OpenCV could not encode a thumbnail")
    return "data:image/jpeg;base64," + base64.b64encode(jpeg.tobytes()).decode()
