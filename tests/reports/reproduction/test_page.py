"""The page of the reproduction, made from the stored results, with its figures and reasons for disagreements."""

import re

from reports.reproduction.claims import claims_of
from reports.reproduction.reproduce import HOME, KEPT, page
from reports.reproduction.runs import Results
from sealtwin.core import files


def test_the_committed_page_equals_the_page_of_the_stored_results():
    """No number on the page is written by hand. Seen to fail with a digit of README.md changed."""
    assert (HOME / "README.md").read_text(encoding="utf-8") == page(Results(**files.read_json(KEPT)))


def test_the_page_links_exactly_the_stored_figures():
    linked = re.findall(r"\]\((figures/[^)]+)\)", (HOME / "README.md").read_text(encoding="utf-8"))
    assert sorted(linked) == sorted(f"figures/{path.name}" for path in (HOME / "figures").iterdir())


def test_every_claim_that_disagrees_has_a_reason():
    assert [
        claim.name for claim in claims_of(Results(**files.read_json(KEPT))) if not (claim.agrees or claim.why)
    ] == []
