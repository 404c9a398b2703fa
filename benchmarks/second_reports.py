"""Drawn after the two faults that the first forty showed were mended, of the kinds where those lay and near them."""

from benchmarks import reported_files as files
from benchmarks import second_files
from benchmarks.first_reports import SLOT
from benchmarks.report_checks import (
    CLICKED,
    LENGTH,
    MM3,
    PASTE,
    ROBOT,
    SCALED,
    TO,
    WIDTH,
    Report,
    has_levels,
    interval_holds,
    mean_depth_is,
    pause_is_kept,
    refused,
    right,
    warned,
)

LENGTH_RIGHT = right(LENGTH, files.CRACK_MM, 1.5)
DEPTHS = f"digitise photo.png --ends 40,150 460,160 --depth-mm depths.csv --mm-per-px 0.1 {TO}"

REPORTS = {
    "photos": (
        Report(
            "haraldk/TwelveMonkeys/issues/184",
            "a TIFF whose colours lie in planes is taken for one with interleaved colours",
            second_files.planar_tiff,
            f"digitise photo.tif {CLICKED}",
            (LENGTH_RIGHT, refused("photo.tif", "planar|plane")),
        ),
        Report(
            "image-rs/image-tiff/issues/400",
            "a tiled TIFF whose width is not a multiple of the tiles' has black columns",
            second_files.tiled_tiff,
            f"digitise photo.tif {CLICKED}",
            (LENGTH_RIGHT, refused("photo.tif", "tile")),
        ),
        Report(
            "darktable-org/darktable/pull/18815",
            "a grey TIFF whose 0 is white is read inverted",
            second_files.mask_of_white_zero,
            f"digitise photo.png --mask mask.tif {SCALED}",
            (right(WIDTH, 2.1, 0.2), refused("mask.tif", "white|inverted")),
        ),
        Report(
            "pnggroup/libpng/issues/853",
            "an interlaced PNG of 16 bits, brought to 8, has wrong values in half of its pixels",
            second_files.interlaced_of_16_bits,
            f"digitise photo.png {CLICKED}",
            (LENGTH_RIGHT, refused("photo.png", "16|interlac|more than 8 bits")),
        ),
        Report(
            "michaelrsweet/pappl/issues/267",
            "a grey PNG of few bits is all black",
            second_files.mask_of_2_bits,
            f"digitise photo.png --mask mask.png {SCALED}",
            (right(WIDTH, 2.1, 0.2), refused("mask.png", "bit")),
        ),
        Report(
            "sumatrapdfreader/sumatrapdf/issues/1544",
            "the orientation that a WebP states is ignored",
            second_files.turned_webp,
            f"digitise photo.webp {CLICKED}",
            (LENGTH_RIGHT, refused("photo.webp", "webp|orientation")),
        ),
        Report(
            "openMVG/openMVG/issues/217",
            "the size in the EXIF is not that of the picture, which was made smaller",
            second_files.size_of_before,
            f"digitise photo.jpg {CLICKED}",
            (LENGTH_RIGHT, refused("photo.jpg", "exif|size")),
        ),
        Report(
            "haraldk/TwelveMonkeys/issues/147",
            "a JPEG in CMYK by Adobe is read inverted",
            second_files.cmyk_by_adobe,
            f"digitise photo.jpg {CLICKED}",
            (LENGTH_RIGHT, refused("photo.jpg", "cmyk")),
        ),
        Report(
            "RodDalBen/SHINE_color/issues/11",
            "what is transparent in a PNG becomes as coloured as the rest",
            second_files.mask_by_transparency,
            f"digitise photo.png --mask mask.png {SCALED}",
            (right(WIDTH, 2.1, 0.2), refused("mask.png", "transparen|alpha|white|whole|all of")),
        ),
    ),
    "tables": (
        Report(
            "numpy/numpy/issues/10448",
            "a table in descending order is interpolated wrongly, without a word",
            second_files.photo_and_depths("44,6", "10,12", "0,12"),
            DEPTHS,
            (mean_depth_is((10 * 12 + 34 * 9) / 44), refused("depths.csv", "10 after 44", "increasing")),
        ),
        Report(
            "equinor/ert/pull/37",
            "two rows of one time with different values: one is taken, without a warning",
            second_files.photo_and_depths("0,10", "22,10", "22,4", "44,10"),
            DEPTHS,
            (refused("depth", "22"), warned("depth", "22")),
        ),
        Report(
            "opensim-org/opensim-core/issues/2536",
            "a table with two rows of one time is read, and one of them holds",
            second_files.aged_material("0,1,5", "10,2,8", "10,4,20", "20,8,40"),
            f"run trial.toml --device cpu {TO}",
            (refused("material.csv", "row 4|line 4"),),
        ),
        Report(
            "jdriver06/CoreFloodManager/issues/7",
            "one more scan over the shear rates comes with the import of a rheometer's table",
            files.flow_curve(*second_files.TWICE_UP),
            PASTE,
            (
                refused("curve.csv", "sweep|twice|branch|hystere|thixotrop|loop|scan|repeat"),
                warned("sweep|twice|branch|hystere|thixotrop|loop|scan"),
                interval_holds(12, 20),
            ),
        ),
        Report(
            "whoenig/uav_trajectories/issues/1",
            "a path that stands still for a while stops the program",
            second_files.path_with_a_pause,
            f"digitise trial.toml {TO}",
            (pause_is_kept, refused("plan.csv", "row|line")),
        ),
    ),
    "sheets": (
        Report(
            "Deltares/ddlpy/issues/24",
            "of several values of one place all but one are dropped, without a word",
            files.text("a.csv", "s_mm,level_mm", "5,-2.0", "10,-2.1", "15,-2.2", "15,-2.6", "10,-2.5", "5,-2.4"),
            'st.read_readings("a.csv").level_mm',
            (has_levels((-2.0, -2.1, -2.2, -2.6, -2.5, -2.4), (-2.2, -2.3, -2.4)), refused("a.csv", "line|row")),
        ),
        Report(
            "vizabi/vizabi/issues/2547",
            "decimal commas and decimal points in one file, separated by semicolons: some numbers are texts",
            files.text("a.csv", "s_mm;level_mm", "5,5;-2,15", "10.5;-2.25", "15,5;-2,05"),
            'st.read_readings("a.csv").level_mm',
            (has_levels((-2.15, -2.25, -2.05)), refused("a.csv", "line|row")),
        ),
    ),
    "meshes": (
        Report(
            "openscad/openscad/issues/945",
            "triangles without area, on an edge that is cut in two, make a sound solid unreadable",
            second_files.stl_with_flat_triangles,
            f"import-mesh block.stl --units mm {TO}",
            (SLOT, refused("block.stl", "area|degenerate|flat")),
        ),
    ),
    "drawings": (
        Report(
            "LibreCAD/LibreCAD/issues/2491",
            "arcs of a block that is inserted mirrored bend the other way",
            second_files.dxf_mirrored_block,
            f"import-dxf a.dxf --outline OUTLINE --depth-mm 10 {TO}",
            (right(MM3, second_files.BULGED_MM3, 24), refused("a.dxf", "mirror|block|insert")),
        ),
        Report(
            "haplokuon/netDxf/issues/184",
            "where two boundaries lie upon each other nothing is filled",
            second_files.dxf_drawn_twice,
            f"import-dxf a.dxf --outline OUTLINE --depth-mm 10 {TO}",
            (right(MM3, 2400, 24), refused("a.dxf", "twice|two|2 |several|copy|same|overlap")),
        ),
    ),
    "robots": (
        Report(
            "robotology-legacy/wysiwyd/pull/70",
            "that a calibration by more than three points failed is not noticed",
            files.robot_cell(second_files.ONE_TOO_HIGH, second_files.FOUR_CORNERS),
            ROBOT,
            (refused("cell.toml", "taught|frame_limit|mm"),),
        ),
    ),
}
