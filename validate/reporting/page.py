"""The report as one page of HTML that needs no other file and no network."""

import base64
import hashlib
from collections.abc import Sequence
from importlib.resources import files as resources
from typing import Any

import cv2
import jinja2
import matplotlib
import numpy as np
from markupsafe import Markup
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from validate.drawing.svg import as_svg, in_page
from validate.drawing.theme import AGES
from validate.evidence import Evidence
from validate.reporting.chapters import Chapter, Command, Item, Model, Photo, Words
from validate.reporting.plates import Plate
from validate.statements.cautions import cautions
from validate.statements.headline import findings, headline, key_figures
from validate.statements.table import Table

PIXELS_DPI = 150
"""Of what is drawn as pixels inside a figure."""
QUALITY = 85
"""Of photos and stills, of 100."""
STOPS = 9
"""Colours between which the page blends a scale: viridis to 1 %."""


def page(evidence: Evidence, content: Sequence[Chapter]) -> str:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("validate"), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    script = resources("validate").joinpath("templates", "turntable.js").read_text(encoding="utf-8")
    verdict, outcome = headline(evidence)
    return environment.get_template("report.html.j2").render(
        name=evidence.name,
        note=evidence.note,
        verdict=verdict,
        outcome=outcome,
        findings=findings(evidence),
        cautions=cautions(evidence),
        key_figures=key_figures(evidence),
        chapters=[
            {
                "title": chapter.title,
                "name": chapter.name,
                "items": [_shown(item, f"{chapter.name}-{number}") for number, item in enumerate(chapter.items)],
            }
            for chapter in content
        ],
        # Ours, and no other script: the page's policy names it by its hash.
        script=Markup(script),
        script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
    )


def _shown(item: Item, name: str) -> dict[str, Any]:
    """What the template needs of an item, and its kind."""
    match item:
        case Photo():
            source = _data_uri(".jpg", item.pixels[:, :, ::-1])
            return {"kind": "photo", "caption": item.caption, "alt": item.alt, "source": source}
        case Model():
            return {
                "kind": "model",
                "caption": item.caption,
                "alt": item.alt,
                "still": _data_uri(".webp", item.turntable.still[:, :, [2, 1, 0, 3]]),
                "mesh": Markup(item.turntable.packed()),
                "colours": _gradient(),
                "oldest": f"{item.turntable.oldest_s:.1f} s",
            }
        case Plate():
            return {
                "kind": "plate",
                "caption": item.caption,
                "svg": in_page(as_svg(item.draw(None), name, PIXELS_DPI), item.caption),
            }
        case Table():
            return {"kind": "table", "title": item.title, "rows": item.rows}
        case Words():
            return {"kind": "words", "sentences": item.sentences}
        case Command():
            return {"kind": "command", "lines": item.lines, "comment": item.comment}


def _gradient() -> str:
    """The colours of ages, as CSS blends them from left to right."""
    stops = matplotlib.colormaps[AGES](np.linspace(0, 1, STOPS))
    return f"linear-gradient(to right, {', '.join(to_hex(stop) for stop in stops)})"


def _data_uri(suffix: str, picture: NDArray[np.uint8]) -> str:
    """``picture`` in OpenCV's order of colours."""
    flag = cv2.IMWRITE_JPEG_QUALITY if suffix == ".jpg" else cv2.IMWRITE_WEBP_QUALITY
    encoded, content = cv2.imencode(suffix, picture, [flag, QUALITY])
    if not encoded:
        raise RuntimeError(f"OpenCV could not encode a picture as {suffix}")
    kind = {".jpg": "jpeg", ".webp": "webp"}[suffix]
    return f"data:image/{kind};base64," + base64.b64encode(content.tobytes()).decode()
