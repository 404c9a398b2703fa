"""Drawn after the fault that the fifth draw showed was mended: again kinds that no earlier draw or log has."""

from benchmarks import reported_files as files
from benchmarks import second_files, sixth_files
from benchmarks.first_reports import SLOT
from benchmarks.report_checks import (
    CLICKED,
    LAB,
    LENGTH,
    LINE,
    MM3,
    SCALED,
    TO,
    WIDTH,
    Report,
    has_levels,
    held,
    refused,
    right,
    settings,
    warned,
)

ALONG = f"import-dxf a.dxf --line CENTRELINE {LINE}"
OUTLINED = f"import-dxf a.dxf --outline OUTLINE --depth-mm 10 {TO}"
LEVELS = 'st.read_readings("{}").level_mm'.format
LENGTH_RIGHT = right(LENGTH, files.CRACK_MM, 1.5)
THREE = has_levels((-2.0, -2.1, -2.2))

REPORTS = {
    "photos": (
        Report(
            "haraldk/TwelveMonkeys/issues/455",
            "a TIFF whose 0 is white comes out inverted where it has a colour profile",
            sixth_files.white_zero_with_profile,
            f"digitise photo.tif {CLICKED}",
            (LENGTH_RIGHT, refused("photo.tif", "icc|profile|white")),
        ),
        Report(
            "wavexx/fgallery/issues/26",
            "a grey picture with a profile of colours",
            sixth_files.grey_with_colour_profile,
            f"digitise photo.jpg {CLICKED}",
            (LENGTH_RIGHT, refused("photo.jpg", "icc|profile")),
        ),
        Report(
            "MouseLand/cellpose/issues/740",
            "a mask has one pixel more, far from what it is of",
            sixth_files.mask_with_a_speck,
            f"digitise photo.png --mask mask.png {SCALED}",
            (right(WIDTH, 2.1, 0.2), refused("mask.png", "pieces|parts|two|2 ")),
        ),
        Report(
            "Fusion-Power-Plant-Framework/bluemira/issues/3066",
            "points are given as a row of x and a row of y, which two points make possible",
            sixth_files.square_photo,
            'st.trace_crack(st.read_photo("crack.png", mm_per_px=0.1), ends_px=[(40, 160), (101, 98)])',
            (refused("dark|no crack|bare|ground|not on"),),
        ),
    ),
    "meshes": (
        Report(
            "cnr-isti-vclab/corto/issues/32",
            "a PLY of quads is not read as one",
            sixth_files.ply_of_polygons,
            f"import-mesh block.ply --units mm {TO}",
            (SLOT, refused("block.ply", "polygon|corners|triangles|concave")),
        ),
        Report(
            "mikedh/trimesh/issues/542",
            "remarks in an OFF stop its import",
            sixth_files.off_with_remarks,
            f"import-mesh block.off --units mm {TO}",
            (SLOT, refused("block.off", "readable|line|remark")),
        ),
        Report(
            "mikedh/trimesh/pull/753",
            "the counts of an OFF stand directly behind its first word",
            sixth_files.off_of_one_head,
            f"import-mesh block.off --units mm {TO}",
            (SLOT, refused("block.off", "readable|header|count")),
        ),
    ),
    "drawings": (
        Report(
            "ieskudero/three-dxf-viewer/issues/34",
            "the arc that closes a polyline is a straight line",
            sixth_files.dxf_arc_that_closes,
            OUTLINED,
            (right(MM3, second_files.BULGED_MM3, 24),),
        ),
        Report(
            "svenhb/GRBL-Plotter/issues/365",
            "the scale at which a block is inserted is left out",
            sixth_files.dxf_scaled_block,
            ALONG,
            (right(LENGTH, 60, 1.5), refused("a.dxf", "block")),
        ),
        Report(
            "haplokuon/netDxf/pull/168",
            "of a polyline that ends where it begins the last corner is lost",
            sixth_files.dxf_ring_not_marked,
            OUTLINED,
            (right(MM3, 2400, 24), refused("a.dxf", "open")),
        ),
        Report(
            "heitzmann/gdspy/issues/91",
            "a corner that comes twice makes NaN",
            sixth_files.dxf_corner_twice,
            ALONG,
            (right(LENGTH, 60, 1.5), refused("a.dxf", "twice|no length")),
        ),
    ),
    "sheets": (
        Report(
            "pandas-dev/pandas/issues/9295",
            "one comma more in the first row shifts all columns",
            files.text("a.csv", "s_mm,level_mm,note", "5,-2.0,a,", "10,-2.1,b", "15,-2.2,c"),
            LEVELS("a.csv"),
            (THREE, refused("a.csv", "line 2|row 2")),
        ),
        Report(
            "PHPOffice/PHPExcel/issues/722",
            "numbers are texts behind an apostrophe",
            sixth_files.numbers_behind_apostrophes,
            LEVELS("a.xlsx"),
            (THREE, refused("a.xlsx", "text|number")),
        ),
        Report(
            "dbro/csvquote/issues/10",
            "a remark of two lines is one cell, and the lines of a file are more than its rows",
            files.text("a.csv", "s_mm,level_mm,note", '5,-2.0,"left', 'edge, 2 of 3"', "10,-2.1,", "15,-2.2,"),
            LEVELS("a.csv"),
            (THREE,),
        ),
    ),
    "notes": (
        Report(
            "angularsen/UnitsNet/issues/72",
            "of feet and inches the inches are left out",
            files.noted("1 ft 1 in"),
            LAB,
            (held("p01_notes", "1 ft 1 in|1 ft"), right(settings("crack.depth_mm", "P01"), 330.2, 0.001)),
        ),
        Report(
            "angularsen/UnitsNet/issues/1423",
            "MM in capital letters is no unit",
            files.noted("8 MM"),
            LAB,
            (held("p01_notes", "8 mm"), right(settings("crack.depth_mm", "P01"), 8, 0)),
        ),
    ),
    "processes": (
        Report(
            "rakhimov/scram/issues/172",
            "paths of a configuration are taken from where the command runs",
            sixth_files.trial_in_a_folder,
            f"digitise sub/trial.toml {TO}",
            (right(WIDTH, 2.1, 0.2),),
        ),
        Report(
            "hayamiz/perfmonger/issues/7",
            "a file that was cut off is taken for whole",
            sixth_files.path_cut_short,
            "simulate run --device cpu --json",
            (refused("trajectory.csv"),),
        ),
        Report(
            "ArduPilot/ardupilot/issues/21409",
            "points of a path that hardly differ end in an internal error",
            sixth_files.path_of_near_twins,
            f"digitise trial.toml {TO}",
            (right(LENGTH, 14.2, 0.5), refused("plan.csv", "row|line"), warned("plan.csv")),
        ),
        Report(
            "SheetJS/sheetjs/issues/1852",
            "a number with a comma that sets thousands apart is two cells",
            files.text("a.csv", "s_mm,level_mm", "995,-2.0", "1,005,-2.1", "1,015,-2.2"),
            LEVELS("a.csv"),
            (THREE, refused("a.csv", "line 3|row 3")),
        ),
    ),
}
