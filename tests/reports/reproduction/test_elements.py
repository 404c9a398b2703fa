"""The table of the paper's elements names what is there, and its page is made of it."""

import re

import pytest

from reports.reproduction.elements import Element, Elements, read_elements
from sealtwin.core.errors import InputError
from tests.places import ROOT

HOME = ROOT / "reports" / "reproduction"


@pytest.fixture(scope="module")
def elements() -> Elements:
    return read_elements(HOME / "paper_elements.toml")


def test_every_file_definition_and_page_that_the_table_names_exists(elements):
    assert list(elements.faults(ROOT)) == []


def test_what_does_not_exist_is_told():
    def table(*lives: str, page: str = "paste") -> Elements:
        return Elements(element=(Element(place="Eq. 1", says="x", lives=lives, faith="faithful", decisions=(page,)),))

    assert list(table("simulate/settings.py:Solver", "Makefile").faults(ROOT)) == []
    assert list(table("simulate/setings.py").faults(ROOT)) == ["Eq. 1: simulate/setings.py is no file."]
    assert list(table("simulate/settings.py:Solvr").faults(ROOT)) == ["Eq. 1: simulate/settings.py defines no Solvr."]
    assert list(table("Makefile", page="pasta").faults(ROOT)) == ["Eq. 1: there is no page of decisions pasta."]


def test_every_section_equation_and_figure_of_the_paper_is_in_the_table(elements):
    """The paper has six sections, of which the third has two and three parts, six equations and eleven figures."""
    places = " ".join(element.place for element in elements.element)
    wanted = [f"Eq. {number}" for number in range(1, 7)] + [f"Fig. {number}" for number in range(1, 12)]
    wanted += ["Algorithm 1", *(f"ection {name}" for name in ("1", "2", "3.1", "3.2.1", "3.2.2", "3.2.3", "3.2.4"))]
    wanted += [f"ection {name}" for name in ("4", "5", "6")]
    assert [name for name in wanted if not re.search(rf"{re.escape(name)}(?!\d)", places)] == []


def test_what_deviates_or_is_missing_says_why(tmp_path):
    path = tmp_path / "table.toml"
    path.write_text('[[element]]\nplace = "Eq. 9"\nsays = "x"\nlives = ["Makefile"]\nfaith = "deviates"\n', "utf-8")
    with pytest.raises(InputError, match="why is not said"):
        read_elements(path)
    path.write_text('[[element]]\nplace = "Eq. 9"\nsays = "x"\nfaith = "faithful"\n', "utf-8")
    with pytest.raises(InputError, match="lives nowhere"):
        read_elements(path)


def test_the_page_is_that_of_the_table(elements):
    page = (HOME / "elements.md").read_text("utf-8")
    assert page == elements.page()
    assert page.count("\n| ") == len(elements.element) + 2
    assert "RECONSTRUCTED" in page
