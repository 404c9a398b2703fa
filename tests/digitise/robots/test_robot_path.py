"""A path in the robot's frame: the limits of the cell, the table read back, and names that stay in comments."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from digitise.robots.cell import LANGUAGES
from digitise.robots.programs import LONGEST, comments, table_text
from digitise.robots.robot_path import place_path
from sealtwin.core.errors import InputError
from sealtwin.core.record_files import read_trajectory
from tests.support.robot_cells import cell, placed, trajectory
from tests.support.robot_readers import READERS


@pytest.mark.parametrize(
    ("planned", "changes", "says"),
    [
        (
            {},
            {"motion": {"largest_speed_mm_s": 5.0}},
            r"approach_speed_mm_s is 20, but motion.largest_speed_mm_s allows at most 5\.",
        ),
        ({"ramp_mm": 3.0, "speed_mm_s": 120.0}, {}, r"2\d{3} mm/s², but motion.acceleration_mm_s2 allows at most 2000"),
        ({}, {"reach": {"low_mm": (400.0, -800.0, -800.0)}}, r"the path leads \d+\.\d mm out of the reach box, to \("),
        # All faults are named at once.
        ({"speed_mm_s": 250.0, "nozzle_height_mm": 50.0}, {}, r"safe_height_mm is 50(.|\n)*cell.toml: .* 250 mm/s"),
    ],
)
def test_a_path_beyond_the_limits_of_the_cell_is_refused(planned, changes, says):
    with pytest.raises(InputError, match=says) as fault:
        placed(trajectory(**planned), **changes)
    assert all(line.startswith("cell.toml: ") for line in str(fault.value).splitlines())


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda it: replace(it, t_s=it.t_s[::-1]), "increasing t_s"),
        (lambda it: replace(it, position_mm=it.position_mm * np.nan), "finite numbers"),
        (lambda it: replace(it, flow_mm3_s=-it.flow_mm3_s), "of 0 or more"),
        (lambda it: replace(it, flow_mm3_s=0 * it.flow_mm3_s), "above 0 in at least one"),
        (lambda it: replace(it, speed_mm_s=2 * it.speed_mm_s), "speed_mm_s "),
    ],
)
def test_an_invalid_trajectory_is_refused(change, says):
    with pytest.raises(InputError, match=f"trajectory.csv: .*{says}"):
        place_path(change(trajectory()), cell(), "cell.toml")


def test_the_csv_table_contains_the_trajectory_in_the_robots_frame(tmp_path):
    """The columns are those of trajectory.csv, so that the same programs read both files."""
    path = placed()
    (tmp_path / "trajectory.csv").write_text(table_text(path), encoding="utf-8")
    again = read_trajectory(tmp_path)
    for name in vars(again):
        assert getattr(again, name) == pytest.approx(getattr(path.trajectory, name), abs=6e-7), name
    assert again.given_mm3.sum() == pytest.approx(4800.0, rel=1e-6)


PATH = placed()
HOSTILE = [
    "bench\nG1 Z-500 F9000",
    "a ; G28\u2028G1 Z-500",
    "*) (*) ! ? ~ \x18 % $X\x85G0 Z0",
    "'''\"\"\" end\ndef evil():\n",
]


@pytest.mark.parametrize("name", HOSTILE)
@pytest.mark.parametrize("language", sorted(name for name, language in LANGUAGES.items() if language.settings))
def test_a_hostile_trial_name_never_becomes_robot_code(name, language):
    """The parsers refuse unknown words; all other words must be the same with any name."""
    text, read = LANGUAGES[language].text, READERS[language]
    plain, named = text(replace(PATH, head=("bench",))), text(replace(PATH, head=(name,)))
    assert read(named) == read(plain)
    assert len(named.splitlines()) == len(plain.splitlines())
    assert named.splitlines()[1:] == plain.splitlines()[1:]


@given(st.lists(st.integers(0, 0x10FFFF).map(chr), max_size=60).map("".join))
@example("0" * 200)
@example("".join(map(chr, range(0x2100))))
def test_a_comment_is_one_line_of_safe_ascii_characters(text):
    comment = comments("", [text])[0]
    assert len(comment.splitlines()) <= 1
    # GRBL obeys ! ? ~ even in comments; % ends a tape, * begins a checksum, quotes and brackets open things.
    assert not set(comment) & set("!?~%*$'\"`;#()[]{}<>\\|&^@\t\x7f")
    assert comment.isascii()
    assert len(comment) <= len(" ") + LONGEST
