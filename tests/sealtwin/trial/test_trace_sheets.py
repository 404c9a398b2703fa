"""Hints go into a trial file, and nothing else of it moves: not a comment, not a blank, not a key."""

import tomllib

import pytest

from digitise.trace_page.session import Hints, Shape
from sealtwin.core.errors import InputError, present
from sealtwin.trial import trace_sheets
from sealtwin.trial.starter_files import TRIAL
from sealtwin.trial.trace_sheets import TrialFile, sheet_of
from sealtwin.trial.trial_file import load_trial
from tests.support.photos import mortar, with_crack, write_png

ENDS = ((12.5, 340.0), (905.0, 377.1))
SAME = Shape()
"""Nothing is said of the shape."""
TRACED = Hints(ends_px=ENDS, via_px=((400.0, 350.0),), mm_per_px=0.1)

COMMENTED = """\
# Our trial.   Do not lose this.
name = "lab-7"          # as on the sample

[photo]                 # taken by Ines
file = "crack.jpg"
data = "measured"
mm_per_px   =   0.2     # from the ruler
edge_fraction = 0.7
#   the lamp stood left

# What calipers said:
[crack]
depth_mm = 16           # three places
tilt     = "flare"
"""


@pytest.fixture
def path(tmp_path):
    return written(tmp_path / "trial.toml")


def written(path, text=COMMENTED):
    path.write_bytes(text.encode())
    return path


def test_only_the_hints_lines_change(tmp_path):
    """Every other line stays as it is, letter by letter; new keys stand under the keys of [photo].

    A run reads what was saved; saving it again changes no byte; and a link stays a link.
    """
    real, path = written(tmp_path / "real.toml"), tmp_path / "trial.toml"
    path.symlink_to(real)
    assert TrialFile(path).save(TRACED, SAME) == ["ends_px", "via_px", "mm_per_px"]
    assert path.is_symlink()
    before, after = COMMENTED.splitlines(), path.read_text().splitlines()
    assert [line for line in after if line not in before] == [
        "mm_per_px   =   0.1     # from the ruler",
        "ends_px = [[12.5, 340.0], [905.0, 377.1]]",
        "via_px = [[400.0, 350.0]]",
    ]
    assert [line for line in before if line not in after] == ["mm_per_px   =   0.2     # from the ruler"]
    assert after.index("ends_px = [[12.5, 340.0], [905.0, 377.1]]") < after.index("#   the lamp stood left")
    assert Hints.of(photo_in(path)) == TRACED
    content, written_ns = real.read_bytes(), real.stat().st_mtime_ns
    assert TrialFile(path).save(TRACED, SAME) == []
    assert (real.read_bytes(), real.stat().st_mtime_ns) == (content, written_ns)


def photo_in(path):
    return present(load_trial(path).photo, "photo")


def test_a_path_alone_has_no_crack_until_a_depth_is_given(path):
    text = COMMENTED[: COMMENTED.index("# What calipers said")].replace("mm_per_px ", "path_only = true\nmm_per_px ")
    written(path, text)
    assert load_trial(path).crack is None
    TrialFile(path).save(TRACED, SAME)
    assert "[crack]" not in path.read_text()
    TrialFile(path).save(TRACED, Shape(depth_mm=12.0))
    assert present(load_trial(path).crack, "crack").depth_mm == 12.0


def test_another_scale_takes_the_place_of_the_old_one_and_numbers_are_written_as_said(path):
    """Markers that the page wrote go with it."""
    ends_px = ((0.1, 1e-7), (12345.6, 3.0))
    ruler = Hints(ends_px=ends_px, ruler_px=((0.0, 0.0), (100.0, 0.0)), ruler_mm=10.0)
    assert "mm_per_px" in TrialFile(path).save(ruler, SAME)
    photo = photo_in(path)
    assert (photo.ends_px, photo.mm_per_px, photo.ruler_mm) == (ends_px, None, 10.0)
    trial = TrialFile(path)
    assert "markers" in trial.save(Hints(face_mm=(160.0, 40.0), frame=(16.0, "4x4_50", 8, None)), SAME)
    assert {"face_mm", "markers"} <= {*trial.save(TRACED, SAME)}
    assert photo_in(path).markers is None


LAYOUTS = {
    "the starter's": TRIAL.replace("{folder}", "x"),
    "markers below": COMMENTED.replace(
        "# What calipers said:",
        "# Printed on 3 May.\n[photo.markers]\nsize_mm = 16.0\nmarkers = ["
        + ", ".join(f"{{ id = {n}, x_mm = {n}.0, y_mm = 0.0 }}" for n in range(4))
        + "]\n",
    ).replace("mm_per_px   =   0.2     # from the ruler\n", ""),
    "dotted keys": 'name = "x"\nphoto.file = "a.jpg" # one\nphoto.data = "measured"\nphoto.mm_per_px = 0.2 # two\n'
    "crack.depth_mm = 16\n",
    "old ends over several lines": COMMENTED.replace(
        "edge_fraction", "ends_px = [\n  [1.0, 2.0],  # this one\n  [3.0, 4.0],\n]\nedge_fraction"
    ),
    "Windows' byte-order mark": "\ufeff" + COMMENTED,
}


GONE = {
    "old ends over several lines": [" this one"],
    "the starter's": [' or "assumed", which every output then states'],
}
"""Comments inside a value, which go with it."""


@pytest.mark.parametrize("layout", LAYOUTS)
def test_comments_and_line_ends_stay_however_a_trial_is_laid_out(path, layout):
    text = LAYOUTS[layout]
    written(path, text)
    TrialFile(path).save(Hints(ends_px=ENDS, mm_per_px=None if layout == "markers below" else 0.1), SAME)
    content = path.read_bytes().decode()
    comments = [line.partition("#")[2] for line in text.splitlines() if "#" in line]
    assert [comment for comment in comments if comment not in content] == GONE.get(layout, [])
    assert photo_in(path).ends_px == ENDS
    assert content.count("\r\n") == (content.count("\n") if "\r\n" in text else 0)
    assert content.startswith("\ufeff") == text.startswith("\ufeff")


def test_a_file_that_somebody_else_changed_is_not_overwritten(path):
    opened = TrialFile(path)
    changed = written(path, COMMENTED.replace("16 ", "17 ")).read_text()
    with pytest.raises(InputError, match="was changed after the page was opened"):
        opened.save(TRACED, SAME)
    assert path.read_text() == changed
    path.unlink()
    with pytest.raises(InputError, match="was changed after"):
        opened.save(TRACED, SAME)


def test_an_edit_that_would_change_more_is_refused(path, monkeypatch):
    """Trust, but look: what an editor of TOML left is read again before it is written."""
    monkeypatch.setattr(trace_sheets, "with_hints", lambda text, *_: (text.replace("16 ", "61 "), ["ends_px"]))
    with pytest.raises(InputError, match=r"Add these lines yourself: ends_px = \[\[12.5, 340.0\]"):
        TrialFile(path).save(TRACED, SAME)
    assert path.read_text() == COMMENTED


def test_settings_of_the_command_are_saved_with_the_hints(path):
    """They drew the walls on the page; those that exclude each other replace each other, and comments stay."""
    written(path, f"{COMMENTED}\n[fluid]\nU = 30.0\nD_cm = 0.3\nfreeze_after_s = 2.58\n")
    mask = path.with_name("m.png")
    settings = {"photo.edge_fraction": 0.6, "photo.mask": mask, "fluid.viscosity_pa_s": 0.5, "seed": 3}
    changed = TrialFile(path, settings).save(Hints(ends_px=ENDS, mm_per_px=0.1), SAME)
    assert {"edge_fraction", "mask", "viscosity_pa_s", "seed"} <= {*changed}
    read = tomllib.loads(path.read_text())
    assert (read["photo"]["edge_fraction"], read["photo"]["mask"], read["seed"]) == (0.6, "m.png", 3)
    assert "U" not in read["fluid"]
    assert "Do not lose this." in path.read_text()


def test_a_photo_without_a_trial_opens_by_the_settings_of_the_command(tmp_path):
    photo = write_png(tmp_path / "crack.png", with_crack(mortar(), [(40, 150), (460, 140)]))
    assert sheet_of(photo, {}).open().session.hints.mm_per_px is None
    given = {"photo.face_mm": [50.0, 30.0], "photo.ends_px": [[40, 150], [460, 140]], "crack.depth_mm": 8, "seed": 3}
    opened = sheet_of(photo, given).open()
    assert opened.session.hints.ends_px == ((40.0, 150.0), (460.0, 140.0))
    assert opened.facts["shape"] == {"depth_mm": 8.0}
    opened.save(opened.session.hints, Shape(depth_mm=8.0))
    # Not below the comment on the next table, that it is the starter's.
    assert "[crack]\ndepth_mm = 8\n" in (tmp_path / "crack.toml").read_text()
    trial = load_trial(tmp_path / "crack.toml")
    assert (trial.seed, present(trial.photo, "photo").face_mm) == (3, (50.0, 30.0))
