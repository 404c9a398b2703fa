"""The table of the paper's elements names what is there, and its page is made of it."""

import pytest

from reports.reproduction.elements import Elements, read_elements
from tests.places import ROOT

HOME = ROOT / "reports" / "reproduction"


@pytest.fixture(scope="module")
def elements() -> Elements:
    return read_elements(HOME / "paper_elements.toml")


def test_every_file_definition_and_page_that_the_table_names_exists(elements):
    assert list(elements.faults(ROOT)) == []


def test_the_page_is_that_of_the_table(elements):
    assert (HOME / "elements.md").read_text("utf-8") == elements.page()
