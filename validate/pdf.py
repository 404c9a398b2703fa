"""The report as A4 pages, by matplotlib alone: no browser, no fonts of the system."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from numpy.typing import NDArray

from validate import facts
from validate.cautions import cautions
from validate.evidence import Evidence
from validate.plates import Plate
from validate.theme import MEASURED, MUTED, THIRD, printable, themed
from validate.typeset import DPI, HEIGHT_IN, MARGIN_IN, WIDTH_IN, Typesetter, wrapped

CAPTION_PT = 8.0
OUTCOME_COLOUR = {"passed": THIRD, "failed": MEASURED, "open": MUTED}


def write_pdf(path: Path, evidence: Evidence, overlay: NDArray[np.uint8], plates: Sequence[Plate]) -> None:
    """Summary, figures, then every table. The same evidence gives the same bytes: no date is written."""
    metadata = {"Title": printable(evidence.name), "Creator": "sealtwin", "CreationDate": None, "ModDate": None}
    verdict, outcome = facts.headline(evidence)
    with themed(), PdfPages(path, metadata=metadata) as pages:
        front = Typesetter(pages)
        front.text(evidence.name, size_pt=20, weight="bold")
        front.text(evidence.note, colour=MUTED)
        for caution in cautions(evidence):
            front.text(caution, size_pt=10, weight="bold", colour=MEASURED)
        front.text(verdict, size_pt=11, weight="bold", colour=OUTCOME_COLOUR[outcome])
        front.rows(facts.key_figures(evidence))
        front.picture(overlay)
        front.text("The walls and the centreline that were found, over the photo.", colour=MUTED)
        front.end()
        for together in _by_page(plates):
            pages.savefig(_figure_page(together), dpi=DPI)
        back = Typesetter(pages)
        back.heading("Assumptions")
        for sentence in facts.assumptions(evidence):
            back.text(sentence)
        for table in facts.tables(evidence):
            back.heading(table.title)
            back.rows(table.rows)
        back.end()


def _by_page(plates: Sequence[Plate]) -> Iterator[list[Plate]]:
    """As many figures on a page as their heights allow."""
    page: list[Plate] = []
    left_in = HEIGHT_IN - 2 * MARGIN_IN
    for plate in plates:
        if page and plate.height_in > left_in:
            yield page
            page, left_in = [], HEIGHT_IN - 2 * MARGIN_IN
        page.append(plate)
        left_in -= plate.height_in
    if page:
        yield page


def _figure_page(plates: Sequence[Plate]) -> Figure:
    across, up = MARGIN_IN / WIDTH_IN, MARGIN_IN / HEIGHT_IN
    page = Figure(
        figsize=(WIDTH_IN, HEIGHT_IN),
        layout=ConstrainedLayoutEngine(rect=(across, up, 1 - 2 * across, 1 - 2 * up), hspace=0.03),
    )
    heights_in = [plate.height_in for plate in plates]
    free_in = max(HEIGHT_IN - 2 * MARGIN_IN - sum(heights_in), 0.01)
    parts = page.subfigures(len(plates) + 1, 1, height_ratios=[*heights_in, free_in], squeeze=False)[:, 0]
    for plate, part in zip(plates, parts[:-1], strict=True):
        plate.draw(part)
        caption = "\n".join(wrapped(plate.caption, WIDTH_IN - 2 * MARGIN_IN, CAPTION_PT))
        part.supxlabel(caption, fontsize=CAPTION_PT, color=MUTED, x=0.0, ha="left")
    return page
