"""Drawn after the two faults that the third draw showed were mended: again kinds that no earlier draw or log has."""

import json

from benchmarks import fourth_files
from benchmarks import reported_files as files
from benchmarks.first_reports import SLOT
from benchmarks.report_checks import (
    LAB,
    LENGTH,
    LINE,
    MM3,
    ROBOT,
    SCALED,
    TO,
    WIDTH,
    Ended,
    Report,
    has_levels,
    held,
    refused,
    right,
    warned,
)

ALONG = f"import-dxf a.dxf --line CENTRELINE {LINE}"
LEVELS = 'st.read_readings("{}").level_mm'.format


def photo_is_kept(ended: Ended) -> bool:
    """The photo is where it was, whole, whatever the answer."""
    path = ended.out.parent / "given" / "photo.png"
    with path.open("rb") as file:
        return ended.code in (0, 3) and path.stat().st_size > 10_000 and file.read(4) == b"\x89PNG"


def both_are_kept(ended: Ended) -> bool:
    """Each of two photos has its own folder, whether it could be traced or not."""
    return ended.code in (0, 6) and len({photo["folder"] for photo in json.loads(ended.stdout)["photos"]}) == 2


def begins_in_mm(ended: Ended) -> bool:
    """G21 stands before the first move, and G20 nowhere."""
    if ended.code != 0:
        return False
    (program,) = (ended.out / "robot").glob("*.gcode")
    words = program.read_text(encoding="utf-8").split()
    first = next(at for at, word in enumerate(words) if word in ("G0", "G00", "G1", "G01"))
    return "G21" in words[:first] and "G20" not in words


REPORTS = {
    "photos": (
        Report(
            "karlch/vimiv-qt/issues/51",
            "a picture is turned twice, since an editor turned it and left the tag",
            fourth_files.stale_orientation,
            f"digitise photo.jpg --mask mask.png {SCALED}",
            (refused("mask"), warned("--mask", "turned")),
        ),
        Report(
            "arahusky/Tensorflow-Segmentation/issues/11",
            "a mask that was saved as JPEG holds all values",
            fourth_files.mask_as_jpeg,
            f"digitise photo.png --mask mask.jpg {SCALED}",
            (right(WIDTH, 2.1, 0.2), refused("mask.jpg", "jpeg|between|brightness")),
        ),
        Report(
            "mantasu/glasses-detector/issues/22",
            "a mask comes out with width and height exchanged",
            fourth_files.mask_of_transposed_shape,
            f"digitise photo.png --mask mask.png {SCALED}",
            (refused("mask.png", "300 x 500"),),
        ),
        Report(
            "oxipng/oxipng/pull/470",
            "a transparent grey that no pixel has makes a mask black and transparent",
            fourth_files.mask_with_an_unused_clear_grey,
            f"digitise photo.png --mask mask.png {SCALED}",
            (right(WIDTH, 2.1, 0.2),),
        ),
    ),
    "meshes": (
        Report(
            "tinyobjloader/tinyobjloader/pull/235",
            "of two objects one is skipped where a material is named before the object",
            fourth_files.obj_of_two_objects,
            f"import-mesh block.obj --units mm {TO}",
            (SLOT,),
        ),
        Report(
            "andymai/gridfinity-layout-tool/pull/1493",
            "a sixth of the triangles is wound the other way, and the volume is wrong",
            fourth_files.stl_of_mixed_winding,
            f"import-mesh block.stl --units mm {TO}",
            (SLOT, refused("block.stl", "wind|orient|inside out|turned|direction")),
        ),
        Report(
            "openscad/openscad/issues/1107",
            "bodies that overlap are exported as they are, with faces inside each other",
            fourth_files.stl_of_overlapping_bodies,
            f"import-mesh block.stl --units mm {TO}",
            (SLOT, refused("block.stl", "overlap|intersect|bodies|shells|parts|pieces")),
        ),
    ),
    "drawings": (
        Report(
            "CadQuery/cadquery/issues/624",
            "the case of a layer's name keeps it from being found",
            fourth_files.dxf_layer_in_small_letters,
            ALONG,
            (right(LENGTH, 60, 1.5), refused("a.dxf", "centreline")),
        ),
        Report(
            "skymakerolof/dxf/issues/79",
            "a binary DXF is not read",
            fourth_files.dxf_binary,
            ALONG,
            (right(LENGTH, 60, 1.5), refused("a.dxf", "binary|ascii|no readable dxf")),
        ),
        Report(
            "Snapmaker/Luban/issues/316",
            "an arc that goes over 0 degrees is lost, or drawn halfway",
            fourth_files.dxf_arc_over_zero,
            ALONG,
            (right(LENGTH, fourth_files.ARC_MM, 1.5),),
        ),
        Report(
            "DomCR/ACadSharp/pull/875",
            "a circle of no radius",
            fourth_files.dxf_circle_of_no_radius,
            f"import-dxf a.dxf --outline OUTLINE --depth-mm 10 {TO}",
            (right(MM3, 2400, 24), refused("a.dxf", "circle|no length|nothing")),
        ),
    ),
    "sheets": (
        Report(
            "yfedoseev/office_oxide/issues/146",
            "cells that stand in another order in the file land in each other's columns",
            fourth_files.cells_out_of_order,
            LEVELS("a.xlsx"),
            (has_levels((-2.0, -2.1, -2.2)), refused("a.xlsx", "order|cell|column")),
        ),
        Report(
            "dankelley/oce/issues/983",
            "-999, which stands for a missing value, is a value",
            files.text("a.csv", "s_mm,level_mm", "5,-2.0", "10,-999", "15,-2.2"),
            LEVELS("a.csv"),
            (refused("a.csv", "999"), has_levels((-2.0, -2.2)), warned("a.csv", "999")),
        ),
        Report(
            "ONLYOFFICE/DocumentServer/issues/2741",
            "numbers with a no-break space behind them are texts, and left out",
            files.text("a.csv", "s_mm;level_mm", "5;-2,0\u00a0", "10;-2,1\u00a0", "15;-2,2"),
            LEVELS("a.csv"),
            (has_levels((-2.0, -2.1, -2.2)), refused("a.csv", "line 2|row 2")),
        ),
        Report(
            "tidyverse/readxl/pull/220",
            "of a merged cell only its first row has the value",
            fourth_files.merged_stations,
            LEVELS("a.xlsx"),
            (
                has_levels((-2.0, -2.1, -2.2, -2.3, -2.4, -2.5), (-2.1, -2.4)),
                refused("a.xlsx", "merged|row 3"),
            ),
        ),
    ),
    "processes": (
        Report(
            "stellar/stellar-core/pull/404",
            "a key behind the head of another table is that table's, and left out without a word",
            fourth_files.trial_with_a_key_elsewhere,
            f"digitise trial.toml {TO}",
            (refused("trial.toml", "crack.mm_per_px"),),
        ),
        Report(
            "genid/Yleaf/issues/55",
            "an output folder that is the input's is emptied first",
            files.photo,
            "digitise photo.png --ends 40,150 460,160 --depth-mm 10 --mm-per-px 0.1 --json --out .",
            (photo_is_kept,),
        ),
        Report(
            "tsduck/tsduck/issues/1740",
            "inputs of one name from two folders overwrite each other's results",
            fourth_files.photos_of_one_name,
            f"digitise first/photo.png second/photo.png --depth-mm 10 --mm-per-px 0.1 {TO}",
            (both_are_kept, refused("photo", "same name|one name|two|twice|both", codes=(2, 3))),
        ),
        Report(
            "NixOS/nix/issues/119",
            "names that differ by case alone",
            fourth_files.twins_by_case,
            LAB,
            (held("p01.png", "2 |two|twice|both"),),
        ),
    ),
    "robots": (
        Report(
            "OpenBuilds/OpenBuilds-CONTROL/issues/113",
            "a program that does not state its unit runs in that of the program before",
            files.robot_cell(files.CORNERS, files.SAMPLE_CORNERS),
            f"{ROBOT} --format gcode",
            (begins_in_mm,),
        ),
    ),
}
