"""Drawn after the two faults that the fourth draw showed were mended: again kinds that no earlier draw or log has."""

from benchmarks import fifth_files
from benchmarks import reported_files as files
from benchmarks.first_reports import SLOT
from benchmarks.report_checks import (
    CLICKED,
    LENGTH,
    LINE,
    MM3,
    PASTE,
    SCALED,
    TO,
    Report,
    has_levels,
    refused,
    right,
    warned,
)

ALONG = f"import-dxf a.dxf --line CENTRELINE {LINE}"
OUTLINED = f"import-dxf a.dxf --outline OUTLINE --depth-mm 10 {TO}"
LEVELS = 'st.read_readings("{}").level_mm'.format
LENGTH_RIGHT = right(LENGTH, files.CRACK_MM, 1.5)

REPORTS = {
    "photos": (
        Report(
            "libvips/libvips/issues/1946",
            "a picture that ends early is read without an error",
            fifth_files.mask_cut_short,
            f"digitise photo.png --mask mask.png {SCALED}",
            (refused("mask.png", "cut short|truncat|damaged"),),
        ),
        Report(
            "sksamuel/scrimage/issues/93",
            "a picture with a tag of orientation for its thumbnail too is not turned",
            fifth_files.two_orientations,
            f"digitise photo.jpg {CLICKED}",
            (LENGTH_RIGHT,),
        ),
        Report(
            "koral--/android-gif-drawable/issues/286",
            "the ending of a file's name is not that of its format",
            fifth_files.webp_named_png,
            f"digitise photo.png {CLICKED}",
            (LENGTH_RIGHT, refused("photo.png", "webp|png")),
        ),
        Report(
            "llSourcell/Object_Detection_demo_LIVE/issues/8",
            "a picture of floats up to 255 is clipped at 1",
            files.photo,
            'st.read_photo(__import__("numpy").full((300, 500), 128.0), mm_per_px=0.1)',
            (refused("float64", "uint8"),),
        ),
    ),
    "meshes": (
        Report(
            "Twinklebear/tobj/issues/15",
            "a group whose name comes twice is taken for two",
            fifth_files.obj_of_groups_named_twice,
            f"import-mesh block.obj --units mm {TO}",
            (SLOT,),
        ),
        Report(
            "bambulab/BambuStudio/issues/11745",
            "transforms of a 3MF's components and items are not those of its unit",
            fifth_files.three_mf_of_a_component,
            f"import-mesh block.3mf --units mm {TO}",
            (SLOT, refused("block.3mf", "component|transform")),
        ),
        Report(
            "cnr-isti-vclab/meshlab/issues/1281",
            "a binary STL whose writer left the number of triangles at 0",
            fifth_files.stl_without_its_count,
            f"import-mesh block.stl --units mm {TO}",
            (SLOT, refused("block.stl", "triangles|faces|header|length")),
        ),
    ),
    "drawings": (
        Report(
            "mozman/ezdxf/issues/330",
            "an arc whose angles are equal is a full circle to some and nothing to others",
            fifth_files.dxf_arc_of_no_angle,
            OUTLINED,
            (right(MM3, 2400, 10), refused("a.dxf", "arc|no length|open|speck"), warned("arc|inside|stone")),
        ),
        Report(
            "mlightcad/realdwg-web/pull/171",
            "one circle of a negative radius costs every other line of the file",
            fifth_files.dxf_circle_of_negative_radius,
            OUTLINED,
            (right(MM3, 2400, 24), refused("a.dxf", "circle|radius")),
        ),
        Report(
            "mozman/ezdxf/issues/640",
            "empty lines behind its end keep a DXF from being read",
            fifth_files.dxf_with_lines_behind,
            ALONG,
            (right(LENGTH, 60, 1.5), refused("a.dxf", "no readable dxf")),
        ),
    ),
    "sheets": (
        Report(
            "weewx/weewx/issues/607",
            "NUL bytes, which an abrupt end leaves in a log, stop its import",
            fifth_files.sheet_with_nul_bytes,
            LEVELS("a.csv"),
            (refused("a.csv", "nul|line 3|byte|zero"),),
        ),
        Report(
            "tilo/smarter_csv/issues/283",
            "marks of inches are unbalanced quotation marks",
            files.text("a.csv", "s_mm\tlevel_mm\tnote", '5\t-2.0\tgauge 3/4"', "10\t-2.1\t", '15\t-2.2\t20" board'),
            LEVELS("a.csv"),
            (has_levels((-2.0, -2.1, -2.2)), refused("a.csv", "quot|line 2|row 2")),
        ),
        Report(
            "tidyverse/readxl/issues/648",
            "cells without their places get into the wrong columns",
            fifth_files.cells_without_places,
            LEVELS("a.xlsx"),
            (has_levels((-2.0, -2.1, -2.2)), refused("a.xlsx", "place|cell|column|row")),
        ),
        Report(
            "adobe/react-spectrum/issues/8545",
            "an apostrophe that sets thousands apart makes no number",
            files.text("a.csv", "s_mm;level_mm", "995;-2,0", "1'000;-2,1", "1'005;-2,2"),
            LEVELS("a.csv"),
            (has_levels((-2.0, -2.1, -2.2)), refused("a.csv", "1'000")),
        ),
        Report(
            "dumbmatter/csv-sql-live/pull/1",
            "of 1.2.3.4 the start, 1.2, is read",
            files.text("a.csv", "s_mm,level_mm", "5,-2.0", "10,-2.1.5", "15,-2.2"),
            LEVELS("a.csv"),
            (refused("a.csv", "-2.1.5"),),
        ),
        Report(
            "PEtab-dev/PEtab/pull/298",
            "rows with an empty cell in the column that groups them are dropped",
            files.text("a.csv", "s_mm,run,level_mm", "5,1,-2.0", "5,,-2.2", "10,1,-2.1", "10,2,-2.3"),
            LEVELS("a.csv"),
            (has_levels((-2.1, -2.2), (-2.0, -2.2, -2.1, -2.3)), refused("a.csv", "line 3|row 3")),
        ),
    ),
    "processes": (
        Report(
            "emancu/toml-rb/issues/63",
            "a table that comes twice in a TOML is one of both",
            fifth_files.trial_with_a_table_twice,
            f"digitise trial.toml {TO}",
            (refused("trial.toml", "crack|twice|line"),),
        ),
        Report(
            "qarmin/czkawka/pull/2038",
            "infinity passes for a number of the command line",
            files.photo,
            f"digitise photo.png --ends 40,150 460,160 --depth-mm 10 --mm-per-px inf {TO}",
            (refused("mm-per-px", "inf", codes=(2, 3)),),
        ),
        Report(
            "openSUSE/obs-service-tar_scm/issues/398",
            "an option that is given twice silently has its last value",
            files.photo,
            f"digitise photo.png {CLICKED} --depth-mm 12",
            (refused("--depth-mm", "twice|once|again|2 times", codes=(2, 3)), warned("--depth-mm", "twice|once")),
        ),
    ),
    "rheometers": (
        Report(
            "DC-analysis/DCscope/issues/104",
            "mPa s stand where Pa s are written",
            files.flow_curve(
                *(f"{rate},{1000 * (12 + 1.5 * rate):g}" for rate in files.RATES),
                header="shear_rate_per_s,stress_mPa",
            ),
            PASTE,
            (refused("curve.csv", "stress_mpa"),),
        ),
    ),
}
