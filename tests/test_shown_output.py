"""Blocks of output in README and documentation are what their commands print today."""

import pytest

from tests.shown_output import PAGES, agree, blocks_of, differences_of, faults_of, is_slow, read_page, rewritten

BLOCKS = {page: list(blocks_of(read_page(page))) for page in PAGES}
RUN = [page for page, blocks in BLOCKS.items() if any(block.is_run for block in blocks)]
PRINTED = ["Crack: 79.5 mm long; cavity 3.95 ml.", "Scale: 0.1001 mm/px.", "Fluid: 12,894 particles in 31.5 s."]


@pytest.mark.parametrize("page", PAGES)
def test_every_block_of_a_page_is_run_or_marked_with_a_reason(page):
    """A block of an unknown kind and an output without a command are faults."""
    assert list(faults_of(BLOCKS[page])) == []


def test_pages_contain_output_blocks_to_compare():
    """Pages without a block to compare would make the tests below pass in silence."""
    shown = [block for blocks in BLOCKS.values() for block in blocks if block.language == "text"]
    assert len(shown) >= 10
    assert len([block for block in shown if block.mark != "not-output"]) >= 5
    assert len(RUN) >= 8
    assert {*QUICK} < {*RUN}


QUICK = ("README.md", "docs/tutorial.md", "docs/how-to/measure-your-paste.md", "docs/how-to/to-the-robot.md")


@pytest.mark.parametrize("page", QUICK)
def test_quick_commands_print_the_output_shown_on_their_page(page, tmp_path):
    """Blocks from the first slow one on are left out. 'python -m tests.shown_output --rewrite' updates the page."""
    assert "\n".join(map(str, differences_of(page, read_page(page), tmp_path, quick=True))) == ""


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in RUN if page not in QUICK or is_slow(BLOCKS[page])])
def test_all_commands_print_the_output_shown_on_their_page(page, tmp_path):
    assert "\n".join(map(str, differences_of(page, read_page(page), tmp_path))) == ""


@pytest.mark.parametrize(("old", "new"), [("cavity", "Cavity"), ("12,894", "13,152")])
def test_a_changed_word_or_number_of_an_output_is_reported_as_a_difference(old, new):
    shown = [line.replace(old, new) for line in PRINTED]
    assert rewritten(shown, PRINTED) == PRINTED
    assert rewritten(["...", *shown[:1], "...", *shown[2:]], PRINTED) == ["...", PRINTED[0], "...", *PRINTED[2:]]


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("3.12 mm", "3.14 mm"),
        ("in 31.5 s by CPU (x86_64), Warp 1.19.0", "in 104 s by CPU (arm64), Warp 1.20.1.dev3"),
        ("read /tmp/a1/run of hash 3fa9c1d07b on 2026-11-26", "read /tmp/b2/c/run of hash 00ffab1290 on 2027-01-02"),
    ],
)
def test_times_machines_and_deviations_of_1_percent_are_ignored(one, other):
    assert agree(one, other)
    assert rewritten([one], [other]) == [one]
    assert not agree("4 mm/s", "5 mm/s"), "a speed is no fact of the machine"
    assert not agree("2 samples", "3 samples")
