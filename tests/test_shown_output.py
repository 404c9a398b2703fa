"""Blocks of output in README and documentation are what their commands print today."""

import pytest

from tests.shown_output import PAGES, agree, blocks_of, differences_of, faults_of, is_slow, read_page, rewritten

BLOCKS = {page: list(blocks_of(read_page(page))) for page in PAGES}
RUN = [page for page, blocks in BLOCKS.items() if any(block.is_run for block in blocks)]
PRINTED = [
    "Crack: 79.5 mm long, 3.12 mm wide (path: ends); cavity 3.95 ml, sealant 3.95 ml.",
    "Scale: 8 4x4_50 markers of 16 mm, 0.1001 mm/px, uncertain by 0.045 %, residual 0.004 mm.",
    "Fluid: 12,894 particles in 31.5 s, 0 escaped; CPU (x86_64), Warp 1.19.0.",
    "Folder: reports/my-trial",
]


@pytest.mark.parametrize("page", PAGES)
def test_every_block_is_run_or_says_why_not(page):
    """Commands, scripts, outputs and files: a block of no known kind, or output of nothing, is a fault."""
    assert list(faults_of(BLOCKS[page])) == []


def test_output_is_shown_and_compared():
    """Pages without a block to compare would make the tests below pass in silence."""
    shown = [block for blocks in BLOCKS.values() for block in blocks if block.language == "text"]
    assert len(shown) >= 10
    assert len([block for block in shown if block.mark != "not-output"]) >= 5
    assert len(RUN) >= 8
    assert {*QUICK} < {*RUN}


QUICK = ("README.md", "docs/tutorial.md", "docs/how-to/measure-your-paste.md", "docs/how-to/to-the-robot.md")


@pytest.mark.parametrize("page", QUICK)
def test_output_of_quick_commands(page, tmp_path):
    """As far as the first slow block of the page. 'python -m tests.shown_output --rewrite' mends what differs."""
    assert "\n".join(map(str, differences_of(page, read_page(page), tmp_path, quick=True))) == ""


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in RUN if page not in QUICK or is_slow(BLOCKS[page])])
def test_output_of_all_commands(page, tmp_path):
    assert "\n".join(map(str, differences_of(page, read_page(page), tmp_path))) == ""


@pytest.mark.parametrize(
    ("old", "new"), [("cavity", "Cavity"), ("12,894", "13,152"), (" mm wide", " cm wide"), ("79.5", "-79.5")]
)
def test_another_word_or_number_is_found(old, new):
    shown = [line.replace(old, new) for line in PRINTED]
    assert shown != PRINTED
    assert rewritten(shown, PRINTED) == PRINTED
    assert rewritten(["...", *shown[:1], "...", *shown[2:]], PRINTED) == ["...", PRINTED[0], "...", *PRINTED[2:]]
    assert rewritten(shown[1:], PRINTED) == rewritten([*shown, "one too many"], PRINTED) == PRINTED


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("3.12 mm", "3.14 mm"),
        ("in 31.5 s", "in 104 s"),
        ("CPU (x86_64), Warp 1.19.0", "CPU (arm64), Warp 1.20.1.dev3"),
        ("on 2026-11-26 01:48", "on 2027-01-02 23:59"),
        ("read /tmp/a1/run of hash 3fa9c1d07b", "read /tmp/b2/c/run of hash 00ffab1290"),
        ("reports/crack/a.csv", r"reports\crack\a.csv"),
        ("A    0.5  mm", "A   0.5   mm"),
    ],
)
def test_times_machines_and_one_percent_are_no_difference(one, other):
    assert agree(one, other)
    assert rewritten([one], [other]) == [one]
    assert not agree("4 mm/s", "5 mm/s"), "a speed is no fact of the machine"
    assert not agree("2 samples", "3 samples")


@pytest.mark.parametrize(
    ("page", "fault"),
    [
        ("```\nx\n```", "no such kind of block"),
        ("```sh\nsealtwin doctor\n```\n```toml\nx = 1\n```\n```text\nx\n```", "nothing is run"),
        ("```sh quick\nsealtwin doctor\n```", "no such mark"),
    ],
)
def test_a_block_without_a_kind_or_a_source_is_found(page, fault):
    (sentence,) = faults_of(list(blocks_of(page.splitlines())))
    assert fault in sentence
