"""One way to fill a crack: what is given to it reaches the method that fills."""

import numpy as np

from sealtwin.core.progress import Progress
from sealtwin.core.records import Profile, Run, Sample
from simulate.run import fill, fill_each
from simulate.settings import LEVEL, Fluid, Nozzle, SampleSlope, Solver
from tests.fluids import LIKE_THE_PAPER, path, sample_of, slot

FAST = Solver(model="slot", settle_s=2.0)


def stiff(yield_stress_pa: float) -> Fluid:
    return Fluid(viscosity_pa_s=0.3, yield_stress_pa=yield_stress_pa, freeze_after_s="never")


def sample(volume_ml: float) -> Sample:
    crack = slot(40.0)
    return sample_of(crack, path(crack[1], volume_ml, trim_mm=6.0))


def one_of_each(fluid: Fluid, volume_ml: float, slope: SampleSlope = LEVEL) -> list[tuple[Run, Profile]]:
    """Filled alone, and as one of a study."""
    alone = fill(sample(volume_ml), fluid, FAST, Nozzle(), seed=0, slope=slope)
    (each,) = fill_each(sample(volume_ml), [fluid], FAST, Nozzle(), seed=0, device="cpu", slope=slope)
    assert isinstance(each, tuple)
    return [alone, each]


def test_the_fast_model_fills_a_sample_that_does_not_lie_level():
    """Thin paste runs downhill, towards -x, where a rise of 6 degrees makes the level over a millimetre higher."""
    slope = SampleSlope(gradient_deg=6.0)
    (_, level), (_, again) = one_of_each(stiff(1.0), 1.2)
    assert np.array_equal(level.level_mm, again.level_mm)
    for run, sloped in one_of_each(stiff(1.0), 1.2, slope):
        assert run.settings["sample"] == slope.model_dump()
        higher_mm = sloped.level_mm - level.level_mm
        assert higher_mm[:20].mean() > 1 > -1 > higher_mm[-20:].mean()


def test_a_fill_alone_is_advised_and_one_of_a_study_is_not():
    """A dozen fills more for each of hundreds of runs would be read by nobody."""
    alone, each = ([*run.unfit] for run, _ in one_of_each(stiff(11.0), 1.6))
    assert alone[-1].startswith("Inside its domain with: ")
    assert each == alone[:-1]
    assert each


def test_what_particles_cannot_show_is_said_as_they_start():
    class Ear(Progress):
        heard: tuple[str, ...] = ()

        def warn(self, text: str) -> None:
            self.heard = (*self.heard, text)

    crack, ear = slot(12.0), Ear()
    run, _ = fill(
        sample_of(crack, path(crack[1], 0.01, speed_mm_s=20.0)),
        LIKE_THE_PAPER,
        Solver(),
        Nozzle(),
        seed=0,
        progress=ear,
    )
    assert run.remarks
    assert ear.heard == tuple(f"note: {remark}" for remark in run.remarks)
