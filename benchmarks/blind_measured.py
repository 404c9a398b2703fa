"""A crack, its paste and its pump in truth, and what a lab with a photo, a scale and a cup finds of them: EMULATED."""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.kept_runs import KeptRuns
from benchmarks.material_by_scale import PumpOfPower, Spread, flow_curve, photo_of, spread_out, weighed
from benchmarks.slumps import DENSITY_KG_M3, MINI_CONE, replayed
from benchmarks.weighing import poured_into
from digitise.settings import CrackShape
from digitise.solid.build_solid import build_solid, with_weighed
from digitise.spread import measure_spread
from digitise.trajectory import plan_trajectory
from digitise.weighing.fit_cavity import weigh
from digitise.weighing.moved_walls import widened
from sealtwin.core.errors import InputError
from sealtwin.core.records import Sample
from sealtwin.core.settings import checked
from sealtwin.material.by_spread import COURSE, LIFT_ERROR_S, viscosity
from sealtwin.material.paste import DENSITY_ERROR
from sealtwin.study.moved_inputs import Base
from sealtwin.trial.trial_file import Trial
from simulate.settings import FINE, Nozzle
from simulate.slot.run import pour
from simulate.slump import STEP, Slump, slump
from simulate.spread_law import GRAVITY_M_S2
from tests.shapes import CUT, random_crack

LENGTH_MM, TRIM_MM, SETTLE_S = 40.0, 8.0, 3.0
WIDTH_SD_MM, DEPTH_SD_MM = 0.1, 0.5  # Of a traced width, and of a depth by a gauge
SPEED_SD_MM_S, START_SD_MM = 0.05, 0.5
EARLY = (0.88, 0.95)  # Frames of a film that the lab takes, by their share of the spread at rest
FLOWS = (0.5, 0.8, 1.1, 1.5, 2.0)  # At which the pump is weighed, over the flow of the path
DOUBTFUL_PERCENT = 35.0  # Standard uncertainty of a viscosity by film above which the lab takes a rheometer
COURSES = Path(__file__).parent / "blind" / "courses.csv"
KEPT = KeptRuns(COURSES.parent, "python -m benchmarks.blind_cases --tune && python -m benchmarks.blind_cases")
POWERS = (-8, -9, -10)  # Of ``STEP``: stresses of the mini-cone of 5 to 13 Pa


@dataclass(frozen=True)
class Truth:
    """What nobody knows: draws of what a lab chooses, and of the errors that it makes."""

    width_mm: float
    depth_mm: float
    angle_deg: float
    yield_stress_pa: float
    viscosity_pa_s: float
    fill: float
    speed_mm_s: float


LOW = Truth(3.8, 9.0, 1.5, 5.5, 1.0, 0.5, 5.0)
HIGH = Truth(5.2, 12.0, 6.0, 12.0, 5.0, 0.85, 8.0)
IN_LOGARITHMS = ("yield_stress_pa", "viscosity_pa_s")


@dataclass(frozen=True, eq=False)
class Measured:
    """A trial as a lab knows it, and the same as it is."""

    truth: Truth
    base: Base
    viscosity_by: str
    real: Sample
    real_fluid: dict[str, float]

    @property
    def facts(self) -> dict[str, float | str]:
        """Truth and finding of each input, with its standard uncertainty."""
        trial, sample = self.base.trial, self.base.sample
        fluid, inputs = trial.fluid, self.base.inputs
        assert fluid is not None
        pairs = {
            "width_mm": (self.real.outline.mean_width_mm, sample.outline.mean_width_mm),
            "depth_mm": (self.real.solid.depth_mm, sample.solid.depth_mm),
            "wall_angle_deg": (self.real.solid.wall_angles_deg[0], sample.solid.wall_angles_deg[0]),
            "yield_stress_pa": (self.truth.yield_stress_pa, fluid.yield_stress_pa),
            "viscosity_pa_s": (self.truth.viscosity_pa_s, fluid.viscosity_pa_s or 0.0),
            "volume_ml": (self.real.trajectory.dispensed_mm3 / 1e3, sample.trajectory.dispensed_mm3 / 1e3),
        }
        rows: dict[str, float | str] = {}
        for name, (true, value) in pairs.items():
            rows |= {name: f"{true:.4g}", f"{name}, measured": f"{value:.4g}"}
        rows |= {f"u of {name}": f"{value:.3g}" for name, value in inputs.items()}
        return rows | {"viscosity by": self.viscosity_by}


def drawn(seed: int, number: int) -> Truth:
    random = np.random.default_rng([seed, number])
    values = {}
    for name in Truth.__dataclass_fields__:
        low, high = getattr(LOW, name), getattr(HIGH, name)
        share = random.uniform()
        values[name] = float(low * (high / low) ** share if name in IN_LOGARITHMS else low + (high - low) * share)
    return Truth(**values)


def measured(seed: int, number: int, folder: Path) -> Measured:
    """Emulate all measurements of a trial; ``folder`` takes photos and tables."""
    truth, random = drawn(seed, number), np.random.default_rng([seed, number, 1])
    traced = random_crack("plain", 1000 * seed + number, LENGTH_MM, truth.width_mm, ends=CUT)
    outline = widened(traced, float(random.normal(0, WIDTH_SD_MM)))
    shape = CrackShape(depth_mm=truth.depth_mm, tilt="flare", wall_angle_deg=truth.angle_deg)
    fill, _ = poured_into(random, outline, shape, "steps")
    gauged_mm = truth.depth_mm + float(random.normal(0, DEPTH_SD_MM))
    gauged = CrackShape.model_validate({"depth_mm": gauged_mm, "tilt": "flare", "fill": fill})
    moved, tilt, by_weight = weigh(traced, gauged, fill, WIDTH_SD_MM, DEPTH_SD_MM)
    solid = with_weighed(build_solid(moved, tilt), by_weight)

    spread = spread_out(truth.yield_stress_pa, number, random, replayed(), folder)
    thick_pa_s, thick_percent, by = viscosity_of(truth, number, spread, random, folder)
    pump = PumpOfPower(random.uniform(0.7, 1.15), random.uniform(0.88, 1.12))
    scatter = random.uniform(0.003, 0.03)
    volume_ml = truth.fill * solid.cavity_volume_mm3 / 1e3
    wanted_mm3_s = 1e3 * volume_ml * truth.speed_mm_s / (traced.length_mm - 2 * TRIM_MM)
    flows = [round(share * wanted_mm3_s) for share in FLOWS]
    table = weighed(pump, scatter, spread.density_kg_m3, DENSITY_ERROR, random, folder, flows)
    given = float(pump.gives(table.asked_for(np.array([wanted_mm3_s]))[0])) / wanted_mm3_s

    width_mm = traced.mean_width_mm
    content: dict[str, Any] = {
        "name": f"blind {seed} {number}",
        "photo": {"file": "drawn.png", "data": "synthetic", "mm_per_px": 0.1},
        "crack": gauged.model_dump(mode="json", exclude_none=True, exclude={"wall_angle_deg"}),
        "path": {"volume_ml": volume_ml, "speed_mm_s": truth.speed_mm_s, "trim_mm": TRIM_MM},
        "fluid": {
            "yield_stress_pa": spread.found.value,
            "viscosity_pa_s": thick_pa_s,
            "density_kg_m3": DENSITY_KG_M3,
            "freeze_after_s": "never",
        },
        "solver": {"radius_mm": round(width_mm / 2 / FINE.abreast, 3), "settle_s": SETTLE_S},
        "nozzle": Nozzle(diameter_mm=2.4).model_dump(mode="json"),
        "uncertainty": {
            "width_mm": WIDTH_SD_MM,
            "depth_mm": DEPTH_SD_MM,
            "yield_stress_pa": spread.found.error,
            "viscosity_percent": thick_percent,
            "volume_ml": volume_ml * table.error_95(wanted_mm3_s) / 2,
            "speed_mm_s": SPEED_SD_MM_S,
            "start_mm": START_SD_MM,
        },
    }
    trial = checked(Trial, folder / "trial.toml", content)
    trajectory = plan_trajectory(moved, trial.path, solid.cavity_volume_mm3, solid.sections)
    sample = Sample(moved, solid, trajectory)
    base = Base(folder, trial, sample, *pour(sample, *trial.physics, seed=0))

    start_mm = float(random.normal(0, START_SD_MM))
    real_path = trial.path.model_copy(
        update={
            "volume_ml": volume_ml * given,
            "speed_mm_s": truth.speed_mm_s + float(random.normal(0, SPEED_SD_MM_S)),
            "trim_mm": (TRIM_MM + start_mm, TRIM_MM - start_mm),
        }
    )
    real_solid = build_solid(outline, shape)
    real_trajectory = plan_trajectory(moved, real_path, solid.cavity_volume_mm3, solid.sections)
    paste = {
        "yield_stress_pa": truth.yield_stress_pa,
        "viscosity_pa_s": truth.viscosity_pa_s,
        "density_kg_m3": spread.density_kg_m3,
    }
    return Measured(truth, base, by, Sample(outline, real_solid, real_trajectory), paste)


def viscosity_of(
    truth: Truth, number: int, spread: Spread, random: np.random.Generator, folder: Path
) -> tuple[float, float, str]:
    """Return viscosity, its standard uncertainty in percent, and by what the lab knows it.

    Two frames of the film of the spread give it, unless the command refuses them or leaves it open: then a rheometer.
    """
    real = course(spread.held_pa, spread.volume_mm3, spread.density_kg_m3)
    assert real.viscosity_pa_s is not None
    slower = truth.viscosity_pa_s / real.viscosity_pa_s * float(np.exp(random.normal(0, COURSE)))
    lift_s = float(random.normal(0, LIFT_ERROR_S))
    early = []
    for share in EARLY:
        radius_mm = share * real.at_rest_mm
        at_s = slower * float(np.interp(radius_mm, np.maximum.accumulate(real.radius_mm), real.t_s))
        early.append((measure_spread(photo_of(radius_mm, number, random, folder), folder), max(0.05, at_s + lift_s)))
    film = course(spread.found.value, spread.found.volume_mm3, DENSITY_KG_M3)
    sheared = flow_curve(truth.yield_stress_pa, truth.viscosity_pa_s, random, folder)
    try:
        value_pa_s, percent = viscosity(spread.heap, spread.found, early, film)
    except InputError:
        percent = np.inf
    else:
        if percent <= DOUBTFUL_PERCENT:
            return value_pa_s, percent, "film of the spread"
    assert sheared.viscosity_error_percent is not None
    if sheared.viscosity_pa_s is not None:
        return sheared.viscosity_pa_s, sheared.viscosity_error_percent, "rheometer"
    # By chance the interval of n excludes 1, so the law has another viscosity at each rate: that of the middle.
    assert sheared.consistency_pa_s_n is not None
    assert sheared.flow_index is not None
    assert sheared.shear_rates_per_s is not None
    middle_per_s = float(np.sqrt(np.prod(sheared.shear_rates_per_s)))
    thick_pa_s = sheared.consistency_pa_s_n * middle_per_s ** (sheared.flow_index - 1)
    return thick_pa_s, sheared.viscosity_error_percent, "rheometer"


def course(stress_pa: float, volume_mm3: float, density_kg_m3: float) -> Slump:
    """Return how a mini-cone goes down with a viscosity of 1 Pa s, between those that are recorded.

    Leaves if another solver computed these.
    """
    KEPT.require()
    length_mm = volume_mm3 ** (1 / 3)
    unit_pa = density_kg_m3 * GRAVITY_M_S2 * length_mm * 1e-3
    table = np.loadtxt(COURSES, delimiter=",", skiprows=1)
    stresses = np.unique(table[:, 0])
    times = table[table[:, 0] == stresses[0], 1]
    radii = [np.interp(times, *table[table[:, 0] == one, 1:].T) for one in stresses]
    place = np.interp(np.log(stress_pa / unit_pa), np.log(stresses), np.arange(len(stresses)))
    low = min(int(place), len(stresses) - 2)
    radius = radii[low] + (place - low) * (radii[low + 1] - radii[low])
    return Slump(stress_pa, volume_mm3, density_kg_m3, times / unit_pa, radius * length_mm, 1.0, 0.0)


def record() -> None:
    """Record slumps of a mini-cone with a constant viscosity, without units; ten minutes of one core."""
    unit_pa = DENSITY_KG_M3 * GRAVITY_M_S2 * MINI_CONE.volume_mm3 ** (1 / 3) * 1e-3
    COURSES.parent.mkdir(exist_ok=True)
    with COURSES.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerow(["stress_over_weight", "time", "radius"])
        for power in POWERS:
            curve = slump(MINI_CONE, STEP**power * unit_pa, DENSITY_KG_M3, steady=True)
            assert curve.viscosity_pa_s is not None, "steady"
            length_mm = curve.volume_mm3 ** (1 / 3)
            times = curve.t_s * DENSITY_KG_M3 * GRAVITY_M_S2 * length_mm * 1e-3 / curve.viscosity_pa_s
            rows = zip(times, curve.radius_mm / length_mm, strict=True)
            csv.writer(file).writerows([f"{STEP**power:.6g}", f"{t:.4g}", f"{radius:.5g}"] for t, radius in rows)
