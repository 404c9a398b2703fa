"""The report as A4 pages, by matplotlib alone: no browser, no fonts of the system."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.backends.backend_pdf import PdfPages

from validate.drawing.pictures import draw_still
from validate.drawing.theme import MUTED, printable, themed
from validate.evidence import Evidence
from validate.reporting.chapters import Chapter, Command, Item, Model, Photo, Words
from validate.reporting.plates import Plate
from validate.reporting.typeset import CAPTION_PT, Typesetter
from validate.statements.cautions import cautions
from validate.statements.headline import findings, headline, key_figures
from validate.statements.table import Table

OUTCOME_COLOUR = {"passed": "#00704f", "failed": "#b3261e", "undecided": "#7a5c00", "open": MUTED}
"""As on the page, by day: each is told from white, and the sentence says the same without it."""
CAUTION = "#7a5c00"
STILL_IN = 3.4


def write_pdf(path: Path, evidence: Evidence, content: Sequence[Chapter]) -> None:
    """What the page shows, in its order. The same evidence gives the same bytes: no date is written."""
    metadata = {"Title": printable(evidence.name), "Creator": "sealtwin", "CreationDate": None, "ModDate": None}
    verdict, outcome = headline(evidence)
    with themed(), PdfPages(path, metadata=metadata) as pages:
        page = Typesetter(pages, evidence.name)
        page.text(evidence.name, size_pt=20, weight="bold")
        page.text(evidence.note, colour=MUTED)
        for caution in cautions(evidence):
            page.text(caution, size_pt=10, weight="bold", colour=CAUTION)
        page.text(verdict, size_pt=11, weight="bold", colour=OUTCOME_COLOUR[outcome])
        for finding in findings(evidence):
            page.text(finding)
        page.rows(key_figures(evidence))
        for chapter in content:
            page.chapter(chapter.title, below_in=_room_in(chapter.items[0]))
            for item in chapter.items:
                _set_down(page, item)
        page.end()


def _set_down(page: Typesetter, item: Item) -> None:
    match item:
        case Photo():
            page.picture(item.pixels)
            page.text(item.caption, CAPTION_PT, colour=MUTED)
        case Model():
            turntable = item.turntable
            page.figure(STILL_IN, lambda on: draw_still(turntable.still, turntable.oldest_s, on), item.caption)
        case Plate():
            page.figure(item.height_in, item.draw, item.caption)
        case Table():
            page.table(item.title, item.rows)
        case Words():
            for sentence in item.sentences:
                page.text(sentence)
        case Command():
            page.text(f"{', then '.join(item.lines)}: {item.comment}")


def _room_in(first: Item) -> float:
    """What must fit below a chapter's title, or the title stands alone at the foot of a page."""
    match first:
        case Plate():
            return first.height_in + 0.5
        case Model():
            return STILL_IN + 0.7
        case _:
            return 0.5
