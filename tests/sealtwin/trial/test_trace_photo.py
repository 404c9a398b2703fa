"""Hints of the trace page, saved into a trial file without a change of its other lines."""

import tomllib

import pytest

from digitise.trace_page.session import Hints, Shape
from sealtwin.core.errors import InputError, present
from sealtwin.trial import trace_photo
from sealtwin.trial.starter_files import TRIAL
from sealtwin.trial.trace_photo import TrialFile, opened
from sealtwin.trial.trial_file import load_trial
from tests.support.photos import mortar, with_crack, write_png

ENDS = ((12.5, 340.0), (905.0, 377.1))
SAME = Shape()
"""A shape without changes."""
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


def test_saving_hints_changes_only_the_hint_lines_of_a_trial_file(tmp_path):
    """New keys are written below the keys of [photo].

    A run reads the saved hints. Saving them again changes no byte, and a symbolic link stays a link.
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


def test_a_path_only_trial_has_no_crack_until_a_depth_is_saved(path):
    text = COMMENTED[: COMMENTED.index("# What calipers said")].replace("mm_per_px ", "path_only = true\nmm_per_px ")
    written(path, text)
    assert load_trial(path).crack is None
    TrialFile(path).save(TRACED, SAME)
    assert "[crack]" not in path.read_text()
    TrialFile(path).save(TRACED, Shape(depth_mm=12.0))
    assert present(load_trial(path).crack, "crack").depth_mm == 12.0


def test_a_saved_scale_replaces_the_old_scale_of_the_trial(path):
    """Markers that the page wrote are removed with their scale."""
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
    "the starter's": TRIAL.replace("{trial}", "x"),
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
def test_comments_and_line_ends_are_kept_in_every_layout_of_a_trial(path, layout):
    text = LAYOUTS[layout]
    written(path, text)
    TrialFile(path).save(Hints(ends_px=ENDS, mm_per_px=None if layout == "markers below" else 0.1), SAME)
    content = path.read_bytes().decode()
    comments = [line.partition("#")[2] for line in text.splitlines() if "#" in line]
    assert [comment for comment in comments if comment not in content] == GONE.get(layout, [])
    assert photo_in(path).ends_px == ENDS
    assert content.count("\r\n") == (content.count("\n") if "\r\n" in text else 0)
    assert content.startswith("\ufeff") == text.startswith("\ufeff")


def test_a_trial_changed_since_the_page_was_opened_is_not_overwritten(path):
    opened = TrialFile(path)
    changed = written(path, COMMENTED.replace("16 ", "17 ")).read_text()
    with pytest.raises(InputError, match="was changed after the page was opened"):
        opened.save(TRACED, SAME)
    assert path.read_text() == changed
    path.unlink()
    with pytest.raises(InputError, match="was changed after"):
        opened.save(TRACED, SAME)


def test_an_edit_that_would_change_other_lines_of_a_trial_is_refused(path, monkeypatch):
    """The edited text is read and compared before it is written."""
    monkeypatch.setattr(trace_photo, "with_hints", lambda text, *_: (text.replace("16 ", "61 "), ["ends_px"]))
    with pytest.raises(InputError, match=r"Add these lines yourself: ends_px = \[\[12.5, 340.0\]"):
        TrialFile(path).save(TRACED, SAME)
    assert path.read_text() == COMMENTED


def test_settings_of_the_trace_command_are_saved_with_the_hints(path):
    """The walls on the page were traced with these settings. U and D give way to the viscosity; comments stay."""
    written(path, f"{COMMENTED}\n[fluid]\nU = 30.0\nD_cm = 0.3\nfreeze_after_s = 2.58\n")
    mask = path.with_name("m.png")
    settings = {"photo.edge_fraction": 0.6, "photo.mask": mask, "fluid.viscosity_pa_s": 0.5, "seed": 3}
    changed = TrialFile(path, settings).save(Hints(ends_px=ENDS, mm_per_px=0.1), SAME)
    assert {"edge_fraction", "mask", "viscosity_pa_s", "seed"} <= {*changed}
    read = tomllib.loads(path.read_text())
    assert (read["photo"]["edge_fraction"], read["photo"]["mask"], read["seed"]) == (0.6, "m.png", 3)
    assert "U" not in read["fluid"]
    assert "Do not lose this." in path.read_text()


def test_settings_of_the_trace_command_apply_to_a_photo_without_a_trial(tmp_path):
    photo = write_png(tmp_path / "crack.png", with_crack(mortar(), [(40, 150), (460, 140)]))
    assert opened(photo, {}).session.hints.mm_per_px is None
    given = {"photo.face_mm": [50.0, 30.0], "photo.ends_px": [[40, 150], [460, 140]], "crack.depth_mm": 8, "seed": 3}
    page = opened(photo, given)
    assert page.session.hints.ends_px == ((40.0, 150.0), (460.0, 140.0))
    assert page.facts["shape"] == {"depth_mm": 8.0}
    page.save(page.session.hints, Shape(depth_mm=8.0))
    trial = load_trial(tmp_path / "crack.toml")
    assert (trial.seed, present(trial.photo, "photo").face_mm) == (3, (50.0, 30.0))
    assert present(trial.crack, "crack").depth_mm == 8.0
