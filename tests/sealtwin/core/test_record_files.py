"""Files of the digitised sample that were damaged by hand."""

import json

import pytest

from sealtwin.core.errors import InputError
from sealtwin.core.record_files import read_outline, read_solid

LINE = [[0.0, 0.0], [10.0, 0.0]]
OUTLINE = {
    **{
        f"{name}_{unit}": LINE for name in ("centreline", "left_wall", "right_wall", "outline") for unit in ("mm", "px")
    },
    **{"ends": ["closed", "closed"], "face_mm": None, "mm_per_px": 0.1, "scale_source": "", "scale_residual_mm": None},
    "path_source": "ends",
}
SECTIONS = {"s_mm": [0.0, 10.0], "depth_mm": [8.0, 8.0], "area_mm2": [16.0, 16.0]}
SOLID = {
    **{"tilt": "lean", "wall_angles_deg": [0.0, 0.0], "depth_mm": 8.0, "block_mm": [0.0, 0.0, 10.0, 10.0]},
    **{"cavity_volume_mm3": 160.0, "face_label": "", "sections": SECTIONS},
}


def test_an_outline_whose_wall_lost_a_point_is_refused(tmp_path):
    (tmp_path / "outline.json").write_text(json.dumps({**OUTLINE, "left_wall_mm": LINE[:1]}))
    with pytest.raises(InputError, match=r"outline\.json.*left_wall_mm.*centreline_mm"):
        read_outline(tmp_path)


@pytest.mark.parametrize(
    ("sections", "words"),
    [
        ({"depth_mm": [8.0]}, "depth_mm.*s_mm"),
        ({"s_mm": [10.0, 0.0]}, "s_mm should increase"),
        ({"levels_mm": [-8.0, 0.0], "below_mm2": [[0.0], [0.0]]}, "below_mm2.*levels_mm"),
    ],
    ids=["lost a depth", "in another order", "areas lack a level"],
)
def test_a_solid_whose_sections_were_damaged_is_refused(tmp_path, sections, words):
    (tmp_path / "solid.json").write_text(json.dumps({**SOLID, "sections": {**SECTIONS, **sections}}))
    with pytest.raises(InputError, match=rf"solid\.json.*{words}"):
        read_solid(tmp_path)
