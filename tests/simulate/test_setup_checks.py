import re
from typing import Any

import manifold3d
import pytest

from benchmarks.hollow import solid_of
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid
from sealtwin.core.errors import InputError
from sealtwin.core.records import Outline, Run, Solid
from tests.support.shapes import OPEN, straight_slot
from tests.support.small_fluids import path, pour

RADIUS_MM = 0.7


def dammed() -> tuple[Solid, Outline]:
    """A crack across the whole of a face of 24 x 40 mm, with a dam of 10 mm at either end."""
    outline = straight_slot(24.0, ends=OPEN)
    return build_solid(outline, CrackShape(depth_mm=6.0, tilt="vertical")), outline


def bridged() -> tuple[Solid, Outline]:
    """A crack of 24 mm in a block, and over its middle a bridge, 2 mm wide, from 1 to 5 mm above the face."""
    block = manifold3d.Manifold.cube((48.0, 30.0, 10.0)).translate((-12, -15, -10))
    bridge = manifold3d.Manifold.cube((2.0, 10.0, 5.0)).translate((11, -5, 0))
    under = manifold3d.Manifold.cube((2.0, 6.0, 1.0)).translate((11, -3, 0))
    cavity = manifold3d.Manifold.cube((24.0, 3.1, 7.0)).translate((0, -1.55, -6))
    return solid_of(block - cavity + (bridge - under), (-12.0, -15.0, 36.0, 15.0), 6.0), straight_slot(24.0)


def poured(crack: tuple[Solid, Outline], diameter_mm: float = 2.4, **more: Any) -> Run:
    way = path(crack[1], 0.1, **{"speed_mm_s": 40.0, "trim_mm": 4.0, **more})
    return pour(crack, way, nozzle_mm=diameter_mm, radius_mm=RADIUS_MM)


def refusal(crack: tuple[Solid, Outline], **settings: Any) -> str:
    with pytest.raises(InputError) as fault:
        poured(crack, **settings)
    return str(fault.value)


@pytest.mark.parametrize(
    ("settings", "fault"),
    [
        ({"trim_mm": 0.0}, r"path.trim_mm .* s = 0 to 24 mm .* first at s = 0.0 mm, .* path.trim_mm of at least"),
        (
            {"trim_mm": 0.0, "reverse": True, "lead_in_mm": 5.0},
            r"path.trim_mm .* s = 24 to 0 mm .* first at s = 2[34].\d mm.* path.trim_mm",
        ),
        ({"diameter_mm": 12.0}, r"nozzle.diameter_mm is 12, .* a smaller nozzle.diameter_mm"),
        ({"nozzle_height_mm": 0.3, "diameter_mm": 7.0}, r"path.nozzle_height_mm is 0.3: .* of at least 0.7,"),
    ],
)
def test_a_path_that_releases_particles_inside_a_dam_or_the_face_is_refused(settings, fault):
    """Without the check five particles of the wide disc end in the dam and count as escaped after the run."""
    assert re.search(fault, refusal(dammed(), **settings))


def test_each_remedy_that_a_refusal_names_makes_the_run_possible():
    """The bridge's side is at 11 mm; the clearance is 0.6 mm, and a release comes each 0.5 mm."""
    message = refusal(bridged())
    first = re.search(r"first at s = ([\d.]+) mm", message)
    assert first
    assert 10.4 <= float(first[1]) <= 10.9
    ways = re.findall(r"path\.(\w+) of at least ([\d.]+\d)", message)
    assert {"trim_mm", "nozzle_height_mm"} >= {name for name, _ in ways} >= {"nozzle_height_mm"}
    for name, value in ways:
        assert poured(bridged(), **{name: float(value)}).escaped_particles == 0
    only_just = poured(dammed(), trim_mm=1.0)
    assert only_just.escaped_particles == only_just.spilled_particles == 0
