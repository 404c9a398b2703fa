"""A commented cell file to start from, for 'sealtwin robot --example FILE'."""

from pathlib import Path

from sealtwin.errors import InputError
from sealtwin.store.files import write_text

CELL = """\
# A robot's cell: where the sample lies in it, what the arm may do, what its program is to look like.
# Use it with:  sealtwin robot RUN --cell {file}
# Every number below is an example: replace it with your own before an arm moves. Millimetres throughout.

name = "bench"
formats = ["spel", "csv"]         # of txt, csv, spel, gcode, urscript; --format says otherwise for one call
robot_z = "up"                    # "down" where the arm's base hangs from a ceiling
frame_limit_mm = 0.5              # a taught point may miss by this at worst

# Three points or more on the sample's face, not in line; a fourth shows errors that three cannot.
# sample_mm: x right, y up in the photo, as in outline.json. With face_mm the lower left corner is [0, 0].
# robot_mm: what the pendant shows with the nozzle's tip on that point.
[[taught]]
sample_mm = [0.0, 0.0]
robot_mm = [250.0, -80.0, 55.0]

[[taught]]
sample_mm = [160.0, 0.0]
robot_mm = [250.0, 80.0, 55.0]

[[taught]]
sample_mm = [0.0, 40.0]
robot_mm = [210.0, -80.0, 55.0]

[reach]                           # the box that the nozzle's tip must not leave, in the robot's frame
low_mm = [150.0, -150.0, 50.0]
high_mm = [350.0, 150.0, 200.0]

[motion]
largest_speed_mm_s = 100.0
acceleration_mm_s2 = 200.0
approach_speed_mm_s = 20.0        # on the way to the path and from it
safe_height_mm = 50.0             # above the face, on that way
largest_tilt_deg = 5.0            # between the nozzle and the face's normal

# [plunger]                       # where the robot drives the syringe itself: gcode, or spel with an axis
# diameter_mm = 20.0              # inner; or mm3_per_mm, where something is geared between
# travel_mm = 60.0
# largest_speed_mm_s = 5.0

[spel]                            # Epson
motion = "curve"                  # CVMove, one speed; "move": a speed for each waypoint
dispenser = "output"              # an output bit; or the axis that presses the plunger: "z", "s" or "t"
output_bit = 8
# axis_start_mm = -20.0           # with z, s or t: that axis with the plunger ready to give
# axis_gives = "-"                # and the way that presses
hand = "right"
u_deg = 0.0
tool = 1                          # its tip must be the nozzle's
local = 0
first_point = 0                   # points from this number on are overwritten

# [gcode]                         # a gantry with an extruder; needs [plunger]
# relative_e = false
# cold_extrusion = true           # Marlin moves no cold extruder otherwise

# [urscript]                      # Universal Robots
# blend_mm = 0.4                  # below half the waypoints' spacing
# dispenser = "analog"            # or "digital"
# port = 0
# full_flow_mm3_s = 1000.0        # at the analog output's full level
"""


def write_example_cell(path: Path) -> None:
    """Raises InputError where ``path`` is there already: nothing is overwritten."""
    if path.exists():
        raise InputError(f"{path}: is there already and is not overwritten; give another name.")
    write_text(path, CELL.replace("{file}", path.name))
