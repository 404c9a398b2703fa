"""The report as A4 pages, by matplotlib alone: no browser, no fonts of the system."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_pdf import PdfPages
from numpy.typing import NDArray

from validate import facts
from validate.cautions import cautions
from validate.evidence import Evidence
from validate.plates import Plate
from validate.theme import MEASURED, MUTED, THIRD, printable, themed
from validate.typeset import CAPTION_PT, Typesetter

OUTCOME_COLOUR = {"passed": THIRD, "failed": MEASURED, "open": MUTED}


def write_pdf(path: Path, evidence: Evidence, overlay: NDArray[np.uint8], plates: Sequence[Plate]) -> None:
    """Summary, figures, then every table. The same evidence gives the same bytes: no date is written."""
    metadata = {"Title": printable(evidence.name), "Creator": "sealtwin", "CreationDate": None, "ModDate": None}
    verdict, outcome = facts.headline(evidence)
    with themed(), PdfPages(path, metadata=metadata) as pages:
        page = Typesetter(pages)
        page.text(evidence.name, size_pt=20, weight="bold")
        page.text(evidence.note, colour=MUTED)
        for caution in cautions(evidence):
            page.text(caution, size_pt=10, weight="bold", colour=MEASURED)
        page.text(verdict, size_pt=11, weight="bold", colour=OUTCOME_COLOUR[outcome])
        page.rows(facts.key_figures(evidence))
        page.picture(overlay)
        page.text(facts.photo_caption(evidence), size_pt=CAPTION_PT, colour=MUTED)
        for plate in plates:
            page.figure(plate.height_in, plate.draw, plate.caption)
        page.heading("Assumptions")
        for sentence in facts.assumptions(evidence):
            page.text(sentence)
        for table in facts.tables(evidence):
            page.table(table.title, table.rows)
        page.end()
