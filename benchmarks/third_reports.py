"""Drawn after the fault that the second draw showed was mended: kinds of input that no earlier draw or log has."""

from benchmarks import reported_files as files
from benchmarks import third_files
from benchmarks.first_reports import SLOT
from benchmarks.report_checks import (
    LAB,
    LENGTH,
    LINE,
    PASTE,
    SCALED,
    TO,
    TWELVE,
    WIDTH,
    Report,
    has_levels,
    held,
    refused,
    right,
    settings,
    warned,
)

SIXTY = right(LENGTH, 60, 1.5)
LEVELS = 'st.read_readings("{}").level_mm'.format
ALONG = f"import-dxf a.dxf --line CENTRELINE {LINE}"

REPORTS = {
    "photos": (
        Report(
            "ocrmypdf/OCRmyPDF/issues/137",
            "a picture whose dots per inch differ across and down is taken for one of square pixels",
            third_files.fax,
            f"digitise photo.tif --ends 40,75 460,80 {SCALED}",
            (
                right(WIDTH, 2.1, 0.25),
                refused("photo.tif", "square|resolution|dots per inch|dpi"),
                warned("square|resolution|dots per inch|dpi"),
            ),
        ),
        Report(
            "opencv/opencv/issues/6468",
            "a JPEG that ends early is read, what is missing being grey",
            third_files.jpeg_cut_short,
            f"digitise photo.jpg --ends 150,40 160,460 {SCALED}",
            (refused("photo.jpg", "cut short|truncat|ends early|ends before|incomplete|damaged|missing"),),
        ),
        Report(
            "ilastik/ilastik/issues/1068",
            "probabilities from 0 to 1 in floats become zeros",
            third_files.mask_of_probabilities,
            f"digitise photo.png --mask mask.tif {SCALED}",
            (right(WIDTH, 2.1, 0.2), refused("mask.tif", "float|32|8 bits")),
        ),
        Report(
            "scikit-image/scikit-image/issues/2523",
            "points are given as row and column where column and row are meant",
            third_files.square_photo,
            'st.trace_crack(st.read_photo("crack.png", mm_per_px=0.1), ends_px=[(101, 40), (98, 160)])',
            (refused("crack.png"), refused("dark|no crack|bare|ground|not on")),
        ),
    ),
    "meshes": (
        Report(
            "lemgandi/3mf2stl/issues/3",
            "the transform that a 3MF's build has for its object is not applied",
            third_files.three_mf_scaled_by_its_build,
            f"import-mesh block.3mf --units mm {TO}",
            (SLOT, refused("block.3mf", "transform|build")),
        ),
        Report(
            "CesiumGS/cesium-native/pull/1108",
            "positions stored as normalised integers come out half or twice as large",
            third_files.glb_quantized,
            f"import-mesh block.glb --units m --set mesh.up=y {TO}",
            (SLOT, refused("block.glb", "quantiz|normali|integer")),
        ),
    ),
    "drawings": (
        Report(
            "skymakerolof/dxf/issues/58",
            "of a block that is inserted as an array only the first copy is read",
            third_files.dxf_array,
            f"{ALONG} --units mm",
            (SIXTY, refused("a.dxf", "block|insert|array")),
        ),
        Report(
            "openscad/openscad/issues/593",
            "a DXF with decimal commas is not refused",
            third_files.dxf_of_commas,
            f"{ALONG} --units mm",
            (SIXTY, refused("a.dxf", "comma|number|readable|coordinate")),
        ),
        Report(
            "LibreDWG/libredwg/issues/1355",
            "a DXF that ends in the middle, without a word, is a smaller drawing to all that read it",
            third_files.dxf_cut_short,
            f"{ALONG} --units mm",
            (refused("a.dxf", "cut short|truncat|ends early|ends before|incomplete|eof|its end|missing endsec"),),
        ),
        Report(
            "OSGeo/gdal/issues/3636",
            "the width of a wide polyline is lost",
            third_files.dxf_wide_line,
            f"{ALONG} --units mm",
            (warned("4 mm|4.0 mm|4.00 mm|pen width"), refused("a.dxf", "4 mm|4.0 mm|4.00 mm")),
        ),
    ),
    "sheets": (
        Report(
            "tidyverse/readxl/issues/533",
            "the first worksheet is read, though it is hidden",
            third_files.hidden_first_sheet,
            LEVELS("a.xlsx"),
            (has_levels((-2.0, -2.1, -2.2)), refused("a.xlsx", "hidden|former|today|worksheet")),
        ),
        Report(
            "MarkPflug/Sylvan.Data.Excel/issues/113",
            "values that were struck out are read as those that count",
            third_files.struck_out,
            LAB,
            (held("p01.xlsx", "struck|strike|crossed"),),
        ),
        Report(
            "apple/turicreate/issues/1692",
            "a quote that is not closed swallows all rows behind it, without a word",
            files.text("a.csv", "s_mm,level_mm,note", "5,-2.0,", '10,-2.1,"left edge', "15,-2.2,", "20,-2.3,"),
            LEVELS("a.csv"),
            (has_levels((-2.0, -2.1, -2.2, -2.3)), refused("a.csv", "quot|line 3|row 3")),
        ),
        Report(
            "pyexcel/pyexcel/issues/138",
            "digits joined by an underscore are read as one number",
            files.text("a.csv", "s_mm,level_mm", "5,-2.0", "10,-2_1", "15,-2.2"),
            LEVELS("a.csv"),
            (refused("a.csv", "2_1"),),
        ),
        Report(
            "SheetJS/sheetjs/issues/2236",
            "decimal commas in a file that commas separate: columns fall apart",
            files.text("a.csv", "s_mm,level_mm", "5,0,-2,15", "10,0,-2,25", "15,0,-2,05"),
            LEVELS("a.csv"),
            (has_levels((-2.15, -2.25, -2.05)), refused("a.csv", "comma|line 2|row 2|cells|columns|separat")),
        ),
    ),
    "notes": (
        Report(
            "markummitchell/engauge-digitizer/issues/243",
            "a decimal comma is one more separator of a CSV",
            files.noted("8,5 mm"),
            LAB,
            (held("p01_notes", "8,5|5 mm|8"), right(settings("crack.depth_mm", "P01"), 8.5, 0)),
        ),
    ),
    "processes": (
        Report(
            "pallets/click/issues/3347",
            "NaN passes the check of a range",
            files.photo,
            f"digitise photo.png --ends 40,150 460,160 --depth-mm nan --mm-per-px 0.1 {TO}",
            (refused("depth", "nan", codes=(2, 3)),),
        ),
        Report(
            "pydantic/pydantic/issues/393",
            "true is taken for the number 1",
            third_files.trial_with_true,
            f"digitise trial.toml {TO}",
            (refused("trial.toml", "path.speed_mm_s"),),
        ),
        Report(
            "BourgeoisLab/GPXLab/issues/29",
            "times of a track that go backwards give wrong speeds",
            third_files.path_of_swapped_times,
            f"digitise trial.toml {TO}",
            (refused("plan.csv", "row|line|t_s|time"),),
        ),
    ),
    "rheometers": (
        Report(
            "bryanvriel/iceutils/pull/25",
            "the sign of a shear rate, which is that of the sense of rotation, gets into the viscosity",
            files.flow_curve(*(f"{-rate},{-12 - 1.5 * rate:g}" for rate in files.RATES)),
            PASTE,
            (TWELVE, refused("curve.csv", "negative|below 0|greater than 0|sign|line 2|row 2")),
        ),
    ),
}
