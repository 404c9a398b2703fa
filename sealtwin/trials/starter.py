"""A commented trial to start from, for 'sealtwin init'."""

from pathlib import Path

from sealtwin.errors import InputError
from sealtwin.store.files import write_text

TRIAL = """\
# A trial: one crack, how it is sealed, and what was measured of it afterwards.
# Run it with:  sealtwin run {folder}/trial.toml
# Lengths are millimetres; pixels count from the centre of the photo's first pixel, x right, y down.

name = "my-trial"
note = ""                       # what a reader of the report must know
seed = 0                        # of the small disorder with which particles leave the nozzle

[photo]
file = "photo.jpg"              # top-down, beside this file
data = "measured"               # or "reconstructed", "synthetic": only measured data can validate
mm_per_px = 0.1                 # the scale: this, a ruler, face_mm or [photo.markers]; it is never guessed
scale_is = "measured"           # "assumed" is said so in every output
# ruler_px = [[100.0, 900.0], [1100.0, 905.0]]   # or two points on a ruler in the plane of the face,
# ruler_mm = 100.0              # and their distance (leave mm_per_px out then)
# face_mm = [160.0, 40.0]       # or width and height of the sample's face
# For [photo.markers] print a frame: 'sealtwin markers --help'.
#
# 'sealtwin trace {folder}/trial.toml' opens a page that finds the crack as you click, and fills these in:
# ends_px = [[12.0, 340.0], [905.0, 377.0]]   # the crack's two ends; the nozzle starts at the first.
#                               # Left out, the crack is searched for: look at overlay.png before you trust it.
# via_px = [[450.0, 352.0]]     # points between them that it passes, where it forks
# roi_px = [[0.0, 300.0], [950.0, 420.0]]     # search inside this box, or polygon, only
# mask = "painted.png"          # the crack painted white on black; nothing is searched for then
# second_photo = "lit-from-the-other-side.jpg"

[crack]
depth_mm = 16.0                 # or a table along the crack: [[0.0, 12.0], [40.0, 16.0]] is [s, depth]
tilt = "lean"                   # lean, flare, funnel or vertical: how the walls go down
wall_angle_deg = 11.0           # each wall's angle from vertical; [left, right] for flare or funnel

[path]
volume_ml = "cavity"            # sealant to give; "cavity" fills the crack up to its face
trim_mm = 10.0                  # the nozzle starts and ends this far from the crack's ends
speed_mm_s = 4.0
flow = "constant"               # or "cross_section": more where the cavity is wider or deeper
ramp_mm = 0.0                   # way in which the nozzle comes to speed, and to a stop
lead_in_mm = 0.0                # straight approach without flow

[fluid]
U = 30.0                        # the paper's fluid viscosity, together with
D_cm = 0.3                      # its wall drag; or, instead of both: viscosity_pa_s = 0.054
yield_stress_pa = 12.0          # below this stress the paste stands; fresh cement grouts have 5 to 37
freeze_after_s = "never"        # or, in place of a yield stress, the age at which sealant has set: 2.58 in the paper

[solver]
preset = "accurate"             # or "paper": the paper's constants
settle_s = 2.0                  # time for the last of it to come to rest before the level is taken

[nozzle]
diameter_mm = 2.4

[output]                        # pictures change nothing of the run
snapshots_s = [0.5, 7.0, 15.0]  # moments that snapshots/ shows
# frames_every_s = 0.1          # frames for ParaView, and for 'sealtwin film'

# What you measured after sealing. Without it the report shows the simulation alone.
# [readings]
# file = "caliper.csv"          # or XLSX, as your lab writes it: what is in doubt is asked, never guessed
# quantity = "depth"            # or "level", where no header says it; likewise unit, decimal, separator, sheet, sample
# datum = "sample_surface"      # or "sealant_top", "caliper_base", which need datum_level_mm, their height above it
# data = "measured"
# role = "held-out"             # or "calibrated-on", where these readings helped to choose U and D
#
# [uncertainty]                 # standard deviations of what you set, for 'sealtwin validate --uncertainty'
# speed_mm_s = 0.1
# volume_ml = 0.1
# width_mm = 0.1
# wall_angle_deg = 1.0          # what is left out is not included, and the report says so
#
# [gate]
# mean_error_mm = 1.6           # the command ends with exit code 5 where the mean error is above
"""

READINGS = "s_mm,level_1_mm,level_2_mm,level_3_mm\n"
"""Level upward from the face, three repeats at each station along the crack."""


def write_starter(folder: Path) -> list[Path]:
    """Write trial.toml and caliper.csv into ``folder``.

    Returns:
        The files written.

    Raises:
        InputError: one of them is there already; nothing is overwritten.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: this is a file; give a folder, new or existing.")
    contents = {
        folder / "trial.toml": TRIAL.replace("{folder}", folder.as_posix()),
        folder / "caliper.csv": READINGS,
    }
    for path in contents:
        if path.exists():
            raise InputError(f"{path}: is there already and is not overwritten; give another folder.")
    for path, text in contents.items():
        write_text(path, text)
    return list(contents)
