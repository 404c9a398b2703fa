"""The page and the PDF that a reviewer signs: both from the same facts and figures."""

import base64
import io
import re
from pathlib import Path

import cv2
import jinja2
import numpy as np
from markupsafe import Markup, escape
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sealtwin.errors import InputError
from sealtwin.files import replacing, write_text
from validate import facts
from validate.cautions import cautions
from validate.evidence import Evidence
from validate.pdf import write_pdf
from validate.plates import Plate, report_plates
from validate.theme import GRID, INK, MUTED, themed

OVERLAY_PX = 1500
"""Widest overlay in the report; the full one lies beside it."""
PIXELS_DPI = 150
"""Of what is drawn as pixels inside a figure."""
NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))
PAGE_COLOURS = {INK: "--ink", MUTED: "--muted", GRID: "--grid", "#ffffff": "--card"}
"""Colours of a figure that follow the page, light or dark."""

__all__ = ["Evidence", "write_report"]


def write_report(folder: Path, evidence: Evidence) -> None:
    """Write report.html, one page that needs no other file and no network, and report.pdf.

    Raises InputError where the overlay cannot be read.
    """
    overlay = _read_overlay(evidence.overlay_path)
    plates = report_plates(evidence)
    write_text(folder / "report.html", _page(evidence, overlay, plates))
    with replacing(folder / "report.pdf") as temporary:
        write_pdf(temporary, evidence, overlay, plates)


def _page(evidence: Evidence, overlay: NDArray[np.uint8], plates: list[Plate]) -> str:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("validate"), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    verdict, outcome = facts.headline(evidence)
    return environment.get_template("report.html.j2").render(
        evidence=evidence,
        verdict=verdict,
        outcome=outcome,
        cautions=cautions(evidence),
        key_figures=facts.key_figures(evidence),
        overlay=_data_uri(overlay),
        photo_caption=facts.photo_caption(evidence),
        figures=[
            {"section": plate.section, "caption": plate.caption, "svg": _svg(plate, f"figure{number}")}
            for number, plate in enumerate(plates)
        ],
        tables=facts.tables(evidence),
        assumptions=facts.assumptions(evidence),
    )


def _svg(plate: Plate, name: str) -> Markup:
    """The figure as inline SVG. Its texts are escaped by matplotlib's own writer; none is a formula or markup."""
    target = io.StringIO()
    # Ids of clip paths must differ between the figures of a page, and not between two runs.
    with themed(), rc_context({"svg.hashsalt": name}):
        figure = plate.draw(None)
        assert isinstance(figure, Figure)
        figure.savefig(target, format="svg", dpi=PIXELS_DPI, transparent=True, metadata=NO_METADATA)
    svg = target.getvalue()
    head, body = svg[svg.index("<svg") :].split(">", 1)
    head = re.sub(r' (width|height)="[^"]*"', "", head)
    for colour, variable in PAGE_COLOURS.items():
        body = body.replace(f": {colour}", f": var({variable})")
    return Markup(f'{head} role="img" aria-label="{escape(plate.caption)}">{body}')


def _read_overlay(path: Path) -> NDArray[np.uint8]:
    """RGB, no wider than the report shows it."""
    content = np.frombuffer(path.read_bytes() if path.is_file() else b"", np.uint8)
    picture = cv2.imdecode(content, cv2.IMREAD_COLOR_RGB) if content.size else None
    if picture is None:
        raise InputError(f"{path}: no readable picture. Run 'sealtwin digitise' again, which draws the overlay.")
    scale = min(1.0, OVERLAY_PX / picture.shape[1])
    return np.asarray(cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _data_uri(picture: NDArray[np.uint8]) -> str:
    encoded, jpeg = cv2.imencode(".jpg", picture[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85])
    if not encoded:
        raise RuntimeError("OpenCV could not encode the overlay")
    return "data:image/jpeg;base64," + base64.b64encode(jpeg.tobytes()).decode()
