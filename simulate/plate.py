"""Paste on a plate, in particles. The plate is the floor of a wide, flat hollow in a block."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np

from sealtwin.core.records import FaceLabel, Floats, Outline, Sections, Solid
from sealtwin.core.solid_figures import SolidFigures
from simulate.bead_law import Bead
from simulate.fluid.solver import Domain, FluidSolver
from simulate.fluid.state import State
from simulate.settings import Fluid, Solver, particle_volume
from simulate.setup.release_schedule import Schedule
from simulate.setup.rheology import FALL
from simulate.setup.signed_distance import CLEARANCE, CM
from simulate.setup.wall_particles import enclose
from simulate.setup_checks import rheology_of
from simulate.spread_law import Cone
from simulate.vessel import Vessel
from simulate.volume_control import VolumeControl

RIM_MM = 5.0  # Thickness of the block around the hollow and below it
HEADROOM = 1.1  # Depth of the hollow over the cone's height: all paste is then below the face
SCATTER = 0.05  # Scatter of a lattice over its spacing: exactly even rows stay on top of each other


@dataclass
class PastePlate:
    """Paste on a plate. The plate's top is z = -depth in the solver's coordinates."""

    engine: FluidSolver
    control: VolumeControl
    vessel: Vessel
    radius_mm: float
    depth_mm: float
    frames: int = 0

    @classmethod
    def with_paste(
        cls,
        shape: Cone | Bead,
        radius_mm: float,
        reach_mm: float,
        density_kg_m3: float,
        curve: Mapping[str, Sequence[float]],
    ) -> "PastePlate":
        """Put paste of a shape in the middle of a plate of half side ``reach_mm``.

        ``curve`` is the viscosity and the yield stress of the paste over age.
        """
        depth_mm = HEADROOM * shape.height_mm
        solid, outline = _dish(reach_mm, depth_mm)
        place_mm = _filled(shape, radius_mm) - [0, 0, depth_mm]
        settings = Solver(radius_mm=radius_mm, substeps=1, damping_per_s=0.0)
        support = 4 * radius_mm * CM
        step_s = 0.9 * math.sqrt(FALL * support / 981.0)
        fluid = Fluid.model_validate({"density_kg_m3": density_kg_m3, "curve": dict(curve), "freeze_after_s": "never"})
        schedule = _all_at_once(place_mm, step_s, radius_mm)
        state, enclosure = State(schedule, "cpu"), enclose(solid, outline, radius_mm, "cpu")
        box = np.array([reach_mm + RIM_MM, reach_mm + RIM_MM, depth_mm + RIM_MM]) * CM
        paste = rheology_of(fluid, support, step_s)
        engine = FluidSolver(
            state,
            enclosure.walls,
            enclosure.barrier,
            Domain(-box, box * [1, 1, 0.5]),
            settings,
            [paste],
            frame_s=step_s,
            substeps=1,
            rows=state.count,
            centreline=outline.centreline_mm * CM,
        )
        factor = engine.scheme.volume_factor
        control = VolumeControl(solid, schedule, state, radius_mm=radius_mm, factor=factor, yields=[paste.yields])
        return cls(engine, control, Vessel(solid), radius_mm, depth_mm)

    def run(self, seconds: float, every_s: float) -> Iterator[float]:
        """Compute ``seconds``, or until all is at rest. Yield the time every ``every_s``, and at the end."""
        step_s = self.engine.step_s
        often = max(1, round(every_s / step_s))
        for number in range(1, round(seconds / step_s) + 1):
            self.engine.begin_frame(self.frames)
            if self.engine.rows == 0:
                break
            self.engine.step()
            self.engine.rest()
            self.frames += 1
            self.control.after_frame(self.frames)
            if number % often == 0:
                yield number * step_s
        yield self.frames * step_s

    @property
    def _place_mm(self) -> Floats:
        return self.engine.state.position_mm()

    @property
    def _half_mm(self) -> float:
        return float(np.cbrt(particle_volume(self.radius_mm))) / 2

    @property
    def volume_mm3(self) -> float:
        """Volume below the surface that the particles form."""
        return self.vessel.volume_mm3(self._place_mm, self._half_mm)

    @property
    def height_mm(self) -> float:
        return float(self._place_mm[:, 2].max()) + self.depth_mm + self._half_mm

    def edge_mm(self, beyond: float) -> float:
        """Radius that contains all but a share ``beyond`` of the particles, plus half a spacing."""
        return float(np.quantile(np.hypot(*self._place_mm[:, :2].T), 1 - beyond)) + self._half_mm

    @property
    def particles_mm(self) -> tuple[Floats, float]:
        """Places of the particles on the plate, (n, 2), and half the side of a particle's cube."""
        return self._place_mm[:, :2], self._half_mm


def _filled(shape: Cone | Bead, radius_mm: float) -> Floats:
    """Return the particles of a shape on z = 0, (n, 3): a lattice with the density of paste, and some scatter."""
    side = float(np.cbrt(particle_volume(radius_mm)))
    points = shape.lattice_mm(side, CLEARANCE * radius_mm)
    # The lattice ends at its sides with a rounding error; stretching makes its volume exact.
    points *= (shape.volume_mm3 / (len(points) * side**3)) ** (1 / 3)
    return points + np.random.default_rng(0).uniform(-SCATTER, SCATTER, points.shape) * side


def _all_at_once(position_mm: Floats, frame_s: float, radius_mm: float) -> Schedule:
    count = len(position_mm)
    return Schedule(
        position_mm=position_mm,
        velocity_mm_s=np.zeros_like(position_mm),
        frame_of=np.zeros(count, dtype=np.int64),
        released=np.array([count]),
        frame_s=frame_s,
        release=count,
        dispensed_mm3=count * particle_volume(radius_mm),
    )


def _dish(reach_mm: float, depth_mm: float) -> tuple[Solid, Outline]:
    """Return a block with a square, flat hollow, and a line across it as the outline that a run needs."""
    out_mm = reach_mm + RIM_MM
    body = manifold3d.Manifold.cube((2 * out_mm, 2 * out_mm, depth_mm + RIM_MM)).translate(
        (-out_mm, -out_mm, -depth_mm - RIM_MM)
    )
    body -= manifold3d.Manifold.cube((2 * reach_mm, 2 * reach_mm, depth_mm + 1)).translate(
        (-reach_mm, -reach_mm, -depth_mm)
    )
    mesh = body.to_mesh()
    vertices, faces = np.array(mesh.vert_properties[:, :3], float), np.array(mesh.tri_verts, dtype=np.int64)
    corner = vertices[faces]
    label = np.full(len(faces), int(FaceLabel.WALL))
    label[(np.abs(corner[:, :, 2]) < 1e-6).all(axis=1)] = FaceLabel.TOP
    at_side = np.abs(np.abs(corner[:, :, :2]) - out_mm) < 1e-6
    outside = np.any(np.all(at_side, axis=1), axis=1)
    label[outside | (corner[:, :, 2] < -depth_mm - 1e-6).all(axis=1)] = FaceLabel.OUTSIDE
    line = np.column_stack([np.linspace(-reach_mm, reach_mm, 3), np.zeros(3)])
    aside = np.array([0.0, reach_mm])
    left, right = line + aside, line - aside
    ring = np.vstack([right, left[::-1]])
    outline = Outline(
        line, left, right, ring, line, left, right, ring, ("cut", "cut"), None, 1.0, "given", None, "ends"
    )
    level = Sections(np.array([0.0, 2 * reach_mm]), np.full(2, depth_mm), np.full(2, 2 * reach_mm * depth_mm))
    block = (-out_mm, -out_mm, out_mm, out_mm)
    hollow_mm3 = (2 * reach_mm) ** 2 * depth_mm
    dish = Solid(vertices, faces, label, block, depth_mm, "vertical", (0.0, 0.0), hollow_mm3, level, SolidFigures())
    return dish, outline
