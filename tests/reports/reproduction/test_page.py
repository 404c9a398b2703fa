"""The page of the repository: made of what is kept, with a figure for each link and a reason for each disagreement."""

import re

from reports.reproduction.claims import claims_of
from reports.reproduction.reproduce import HOME, KEPT, page
from reports.reproduction.runs import Results
from sealtwin.core import files


def test_the_page_is_that_of_the_kept_results():
    """No figure on it is written by hand. Broken on purpose with a digit of README.md changed."""
    assert (HOME / "README.md").read_text(encoding="utf-8") == page(Results(**files.read_json(KEPT)))


def test_every_figure_on_the_page_is_kept_and_no_other():
    linked = re.findall(r"\]\((figures/[^)]+)\)", (HOME / "README.md").read_text(encoding="utf-8"))
    assert sorted(linked) == sorted(f"figures/{path.name}" for path in (HOME / "figures").iterdir())


def test_every_disagreement_has_its_reason():
    assert [
        claim.name for claim in claims_of(Results(**files.read_json(KEPT))) if not (claim.agrees or claim.why)
    ] == []
