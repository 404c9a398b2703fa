from dataclasses import replace

import numpy as np
import pytest

from sealtwin.errors import InputError, NumericalError
from sealtwin.progress import Progress
from sealtwin.records import Run
from simulate import distance, viscosity
from simulate import run as run_module
from simulate.run import check_fit
from simulate.settings import PRESETS, Fluid, Nozzle, Solver
from tests.fluids import LIKE_THE_PAPER, path, pour, slot

LOWER = np.array([0, 0, 2.0])
CORNERS = [(1e-2, 1e-4), (1e-2, 3.0), (1e4, 1e-4), (1e4, 3.0), (30.0, 0.03)]


def height_mm(run: Run) -> float:
    """Of the highest twentieth of the particles: the surface without its strays."""
    return float(np.quantile(run.position_mm[:, 2], 0.95))


@pytest.mark.parametrize("preset", ["accurate", "paper"])
@pytest.mark.parametrize(("u", "d"), CORNERS)
def test_nothing_escapes_at_the_corners_and_the_centre_of_the_papers_range(u, d, preset):
    crack = slot(12.0)
    fluid = Fluid(U=u, D_cm=d, freeze_after_s=0.3)
    run = pour(crack, path(crack[1], 0.12, speed_mm_s=20.0), fluid, preset=preset, settle_s=0.1)
    assert len(run.position_mm) == 363
    assert (run.escaped_particles, run.spilled_particles) == (0, 0)
    assert np.isfinite(run.position_mm).all()
    assert np.isfinite(run.velocity_mm_s).all()
    assert run.position_mm[:, 2].min() > -16


@pytest.mark.parametrize(("tilt", "angle_deg"), [("funnel", 11.0), ("lean", 11.0), ("flare", 5.5)])
def test_nothing_escapes_where_walls_tilt(tilt, angle_deg):
    crack = slot(12.0, tilt=tilt, angle_deg=angle_deg)
    run = pour(crack, path(crack[1], 0.12, speed_mm_s=20.0), settle_s=0.1)
    assert run.escaped_particles == 0


def test_what_runs_over_the_edge_is_spilled_and_not_escaped():
    """A crack of 0.2 ml that gets 1.5 ml, on a face of 12 mm around it."""
    crack = slot(12.0, depth_mm=5.0)
    run = pour(
        crack, path(crack[1], 1.5, speed_mm_s=20.0), Fluid(U=0.1, D_cm=1e-3, freeze_after_s="never"), radius_mm=0.7
    )
    assert run.escaped_particles == 0
    assert 0 < run.spilled_particles < len(run.position_mm)
    x, y = run.position_mm[run.spilled, :2].T
    x_min, y_min, x_max, y_max = crack[0].block_mm
    assert ((x < x_min) | (x > x_max) | (y < y_min) | (y > y_max)).all()


def test_a_cpu_run_repeats_bit_for_bit_and_a_seed_changes_it():
    crack = slot(12.0)
    trajectory = path(crack[1], 0.05, speed_mm_s=20.0)
    first, again, other = (pour(crack, trajectory, seed=seed) for seed in (3, 3, 4))
    assert np.array_equal(first.position_mm, again.position_mm)
    assert np.array_equal(first.velocity_mm_s, again.velocity_mm_s)
    assert not np.array_equal(first.position_mm, other.position_mm)


def test_ages_frames_and_freezing_follow_the_clock():
    crack = slot(12.0)
    trajectory = path(crack[1], 0.08, speed_mm_s=20.0)
    run = pour(crack, trajectory, Fluid(U=30.0, D_cm=0.3, freeze_after_s=0.2), settle_s=0.05)
    frame_s = run.health["frame_s"]
    assert run.age_s[0] == pytest.approx(trajectory.duration_s + 0.05, abs=frame_s)
    assert (np.diff(run.age_s) <= 1e-12).all()
    old = run.age_s > 0.2 + 2 * frame_s
    assert old.any()
    assert (run.velocity_mm_s[old] == 0).all()
    assert (np.abs(run.velocity_mm_s[~old]).max(axis=1) > 0).mean() > 0.9
    assert run.health["moving_most"] < len(run.position_mm)


def test_a_frozen_bed_keeps_its_volume_only_if_it_answers_in_full(monkeypatch):
    """The note: with lambda_j = 0 a frozen bed soaks up fluid (0.279 mm3 a particle for 0.308)."""
    crack = slot(6.0, depth_mm=12.0)
    trajectory = path(crack[1], 0.13, speed_mm_s=2.0)
    fluid = Fluid(U=30.0, D_cm=0.3, freeze_after_s=0.15)
    full = pour(crack, trajectory, fluid)
    monkeypatch.setitem(PRESETS, "accurate", PRESETS["accurate"]._replace(frozen_answer=0.0))
    half = pour(crack, trajectory, fluid)
    filled = [height_mm(run) + 12.0 for run in (full, half)]
    assert filled[1] < 0.97 * filled[0]


def test_without_freezing_the_bed_levels_out():
    """Poured at one end of a long slot: the paper's slope is the freezing's work."""
    crack = slot(30.0, depth_mm=10.0)
    trajectory = path(crack[1], 0.3, speed_mm_s=30.0)
    trajectory = replace(trajectory, position_mm=trajectory.position_mm * [0.2, 1, 1] + [1.0, 0, 0])
    slope = []
    for freeze in (0.3, "never"):
        run = pour(crack, trajectory, Fluid(U=30.0, D_cm=0.03, freeze_after_s=freeze), radius_mm=0.5, settle_s=1.0)
        x, _, z = run.position_mm.T
        # A place that nothing reached is as low as the floor.
        near, far = (np.quantile(np.append(z[(x > a) & (x < b)], -10.0), 0.95) for a, b in ((2, 8), (22, 28)))
        slope.append(near - far)
    assert slope[1] < 1.0
    assert slope[0] > slope[1] + 1.0


def test_physical_units_give_the_same_run_as_their_u():
    """32.2 mm2/s is U = 30 at the paper's radius and frame."""
    crack = slot(12.0)
    trajectory = path(crack[1], 0.05, speed_mm_s=20.0)
    by_weight = pour(crack, trajectory, LIKE_THE_PAPER)
    viscosity_pa_s = by_weight.health["viscosity_m2_s"] * 1500.0
    by_unit = pour(crack, trajectory, Fluid(viscosity_pa_s=viscosity_pa_s, density_kg_m3=1500.0, freeze_after_s=2.58))
    assert by_unit.health["U"] == pytest.approx(30.0)
    assert by_unit.position_mm == pytest.approx(by_weight.position_mm, abs=0.2)


def test_a_collapse_stops_the_run_and_says_what_when_which_and_where():
    """One substep of 38 ms: the column falls into itself."""
    crack = slot(12.0)
    fluid = Fluid(U=0.0, D_cm=0.0, freeze_after_s="never")
    with pytest.raises(NumericalError, match=r"(?s)collapsed.*Frame \d+, t = .* s, particle \d+ at \(.*\) mm\. Try"):
        pour(crack, path(crack[1], 0.3, speed_mm_s=4.0), fluid, substeps=1, iterations=1)


@pytest.mark.parametrize(("limit", "value", "what"), [("FASTEST_CM_S", 1.0, "faster"), ("DENSEST", 0.5, "density")])
def test_speed_and_density_are_watched(monkeypatch, limit, value, what):
    monkeypatch.setattr(f"simulate.solver.{limit}", value)
    crack = slot(12.0)
    with pytest.raises(NumericalError, match=f"{what}.*particle 0"):
        pour(crack, path(crack[1], 0.01, speed_mm_s=20.0))


def test_a_position_that_is_no_number_stops_the_run(monkeypatch):
    plan = run_module.plan_releases

    def poisoned(*arguments):
        schedule = plan(*arguments)
        schedule.position_mm[9] = np.nan
        return schedule

    monkeypatch.setattr(run_module, "plan_releases", poisoned)
    crack = slot(12.0)
    with pytest.raises(NumericalError, match=r"no number any more.*particle 9"):
        pour(crack, path(crack[1], 0.02, speed_mm_s=20.0))


def test_a_solve_that_does_not_converge_stops_the_run(monkeypatch):
    monkeypatch.setattr(viscosity, "SEARCHES_AT_MOST", 1)
    crack = slot(12.0)
    with pytest.raises(NumericalError, match=r"did not converge in 1 iterations. Frame \d+"):
        pour(crack, path(crack[1], 0.02, speed_mm_s=20.0), Fluid(U=1e4, D_cm=3.0, freeze_after_s="never"))


def test_an_escape_is_counted_and_shouted(monkeypatch):
    """The last word has the mesh itself: here a mesh that moved by 2 mm under the finished run."""

    class Ear(Progress):
        heard = ""

        def note(self, text: str) -> None:
            Ear.heard += text

    exact = distance.Barrier.exact_mm
    monkeypatch.setattr(distance.Barrier, "exact_mm", lambda self, points: exact(self, points - LOWER))
    crack = slot(12.0)
    run = run_module.inject(
        *crack,
        path(crack[1], 0.05, speed_mm_s=20.0),
        LIKE_THE_PAPER,
        Solver(settle_s=0.2),
        Nozzle(),
        seed=0,
        device="cpu",
        progress=Ear(),
    )
    assert run.escaped_particles > 10
    assert f"{run.escaped_particles} particles went through a wall" in Ear.heard


@pytest.mark.parametrize(
    ("solver", "nozzle", "fluid", "fault"),
    [
        ({}, {"diameter_mm": 40.0}, {}, r"nozzle.diameter_mm is 40: wider than the face.* 27.1"),
        ({"radius_mm": 0.9}, {}, {}, r"solver.radius_mm is 0.9: fewer than 2 particles fit abreast.*0.775"),
        ({"radius_mm": 0.4}, {"diameter_mm": 0.5}, {}, r"wider than the nozzle.*at most 0.25"),
        ({}, {}, {"freeze_after_s": 0.02}, r"freeze_after_s is 0.02: .*0.057"),
    ],
)
def test_settings_that_cannot_go_together_are_refused_with_the_physics(solver, nozzle, fluid, fault):
    solid, outline = slot()
    table = {"U": 1.0, "freeze_after_s": 1.0} | fluid
    with pytest.raises(InputError, match=fault):
        check_fit(outline, solid, Fluid.model_validate(table), Solver(**solver), Nozzle(**nozzle))


def test_more_particles_than_memory_holds_are_refused(monkeypatch):
    monkeypatch.setattr(run_module, "PARTICLES_AT_MOST", 100)
    crack = slot(12.0)
    with pytest.raises(InputError, match=r"needs 151 particles, 100 are allowed"):
        pour(crack, path(crack[1], 0.05))


def test_health_says_whether_the_run_can_be_trusted():
    crack = slot(12.0)
    health = pour(crack, path(crack[1], 0.05, speed_mm_s=20.0)).health
    assert 0 <= health["density_error_mean"] <= health["density_error_p95"] <= health["density_error_max"] < 0.5
    assert 10 < health["most_neighbours"] <= 128
    assert health["viscosity_iterations_most"] >= health["viscosity_iterations_mean"] > 0
    assert health["wall_particles"] > 1000
    assert health["frames_s"] > 0
