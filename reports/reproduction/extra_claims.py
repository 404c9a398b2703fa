"""What the paper says of damping, of freezing and of time: each a small study of its own."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from reports.reproduction.judging import AnyClaim, Finding, Number, Shape, judge
from reports.reproduction.pace import Pace
from reports.reproduction.redrawn import SETS
from sealtwin.core.records import Floats, Profile
from validate.figures.map_figures import pace_of

ETA_PER_S = (0.02, 0.2, 2.0)
"""The paper's 0.2, a tenth and ten times of it."""
SMALL = 0.1
"""Most that damping may do, as a share of what U and D do to the mean error: else its impact is significant."""
FREEZE_AFTER_S = (2.58, 5.16, "never")
"""The age that the paper's limit of 2,500 moving particles amounts to, twice that, and no such motion constraint."""
D_CM = (0.3, 1.0, 3.0)
"""D of which the times of runs are compared; "the simulation slowed significantly when D > 1 cm"."""
SLOW_FROM_CM = 1.0
SLOWER = 1.5
"""Least ratio of times that is significant."""
STRAIGHT = 0.9
"""Least share of the variance of frame times that a straight line explains where it is almost linear."""
QUIET_CORES = 0.1
"""Most that other processes may have kept busy while a time was taken, in processor cores."""
COMPUTATION = "section 5, Computational power requirement"


@dataclass(frozen=True)
class Damping:
    """Mean errors at each value of eta, means over seeds."""

    mean_mm: Floats
    range_mm: float
    """Of the mean errors over U and D."""

    @property
    def effect(self) -> float:
        """What eta does, over what U and D do."""
        return float(np.ptp(self.mean_mm)) / self.range_mm


@dataclass(frozen=True)
class Freezing:
    """Unevenness of the level, the standard deviation along the crack, at each age of freezing; means over seeds."""

    uneven_mm: Floats


@dataclass(frozen=True)
class Times:
    """Processor times, means over seeds."""

    passes_s: Mapping[float, float]
    """Of a run by D in cm, Eq. 5 in q passes as the paper has it."""
    solved_s: Mapping[float, float]
    """Of a run by D in cm, viscosity solved at once: sealtwin's default."""
    straight: float
    """Share of the variance of frame times that a straight line over the moving particles explains."""


@dataclass(frozen=True)
class Slots:
    """Processor times of a crack and of one a third as wide, four particles abreast in both."""

    wide_s: float
    narrow_s: float


def slowing(time_s: Mapping[float, float]) -> float:
    """Time of a run with D above 1 cm over that up to it."""
    below, above = ([time_s[d] for d in time_s if (d > SLOW_FROM_CM) is is_above] for is_above in (False, True))
    return float(np.mean(above) / np.mean(below))


DAMPING_CLAIM: Shape[Damping] = Shape(
    "no effect of eta, 0.02 to 2 per s, chosen pair",
    "the exact value of η had no significant impact on material behaviour",
    "section 3.2.2, Eq. 4",
    f"range of the mean errors over eta, five seeds each, over that over U and D: less than {SMALL:g}",
    "no significant impact",
    lambda seen: f"{np.ptp(seen.mean_mm):.2f} mm, {seen.effect:.2f} of what U and D do",
    lambda seen: seen.effect < SMALL,
)
FREEZING_CLAIM: Shape[Freezing] = Shape(
    "flatter where fewer particles are fixed, chosen pair",
    "when relaxing this motion constraint, allowing more particles to remain active, the fluid tends to settle to a "
    "flatter state",
    "section 5, Approximation nature",
    f"standard deviation of the level along the crack, five seeds each, fixed after {FREEZE_AFTER_S[0]} s, "
    f"{FREEZE_AFTER_S[1]} s and never: the last is less than the first",
    "flatter",
    lambda seen: ", ".join(f"{value:.2f}" for value in seen.uneven_mm) + " mm",
    lambda seen: bool(seen.uneven_mm[-1] < seen.uneven_mm[0]),
)
TIME_CLAIMS: tuple[AnyClaim[Times], ...] = (
    Shape(
        "slower for D above 1 cm, Eq. 5 in q passes",
        "higher values of D require a large number of viscosity iterations (q in Equation 4), and the simulation "
        "slowed significantly when D > 1 cm",
        "section 4",
        f"processor time of the frames at D = 3 cm over that at 0.3 and 1 cm, U = 30: at least {SLOWER:g}",
        "significantly",
        lambda seen: f"{slowing(seen.passes_s):.2f} times the time",
        lambda seen: slowing(seen.passes_s) >= SLOWER,
    ),
    Shape(
        "slower for D above 1 cm, viscosity solved at once (our default)",
        "the simulation slowed significantly when D > 1 cm",
        "section 4",
        f"the same with the implicit solve, which sealtwin has in place of the passes: at least {SLOWER:g}",
        "significantly",
        lambda seen: f"{slowing(seen.solved_s):.2f} times the time",
        lambda seen: slowing(seen.solved_s) >= SLOWER,
    ),
    Shape(
        "time of a frame linear in the particles",
        "the required time to simulate each frame scales almost linearly with the number of fluid particles",
        f"{COMPUTATION}, Fig. 11",
        f"R² of a straight line through the medians of processor time over moving particles: at least {STRAIGHT:g}",
        "almost linear",
        lambda seen: f"R² = {seen.straight:.2f}",
        lambda seen: seen.straight >= STRAIGHT,
    ),
)
SLOT_CLAIM: Number[Slots] = Number(
    "time of a crack a third as wide, over that of the crack",
    "reducing crack width by a factor of three increases simulation time by a factor of nine, so a 1 mm crack could be "
    "simulated in ~54 minutes compared to the ~6 minutes in this work",
    COMPUTATION,
    "processor time of the frames of two straight cracks of one length and depth, nozzle and sealant in proportion",
    9,
    "times",
    0,
    lambda seen: seen.narrow_s / seen.wide_s,
)


def judge_damping(error_mm: Floats, range_mm: Floats) -> Finding:
    """Mean errors (sets, etas, seeds), the readings as they are first; the range over U and D of each set, (sets,)."""
    means_mm = _means(error_mm)
    seen = Damping(error_mm[0].mean(axis=1), float(range_mm[0]))
    draws = [Damping(mean, float(reach)) for mean, reach in zip(means_mm[1:], range_mm[1:], strict=True)]
    return judge(DAMPING_CLAIM, seen, draws)


def judge_freezing(profiles: Sequence[Sequence[Profile]]) -> Finding:
    """Profiles by age of freezing and by seed. No reading counts here, and the draws are of the scatter alone."""
    uneven_mm = np.array([[profile.level_mm.std() for profile in alike] for alike in profiles])
    draws = _means(np.broadcast_to(uneven_mm, (SETS, *uneven_mm.shape)))
    return judge(FREEZING_CLAIM, Freezing(uneven_mm.mean(axis=1)), [Freezing(each) for each in draws])


def judge_times(passes: Mapping[float, Sequence[Pace]], solved: Mapping[float, Sequence[Pace]]) -> list[Finding]:
    """Paces of runs by D in cm, Eq. 5 in passes and solved at once, as many of each."""
    random = np.random.default_rng(2)
    every = [pace for runs in (*passes.values(), *solved.values()) for pace in runs]
    framed = [pace for runs in solved.values() for pace in runs]
    means_s = [_means(_drawn([_seconds(runs) for runs in kind.values()])) for kind in (passes, solved)]
    seen = Times(_mean_s(passes), _mean_s(solved), _straight(framed))
    draws = [
        Times(
            dict(zip(passes, passed_s, strict=True)),
            dict(zip(solved, solved_s, strict=True)),
            _straight([framed[one] for one in random.integers(len(framed), size=len(framed))]),
        )
        for passed_s, solved_s in zip(*means_s, strict=True)
    ]
    return [_unless_busy(judge(claim, seen, draws), every) for claim in TIME_CLAIMS]


def judge_slots(wide: Sequence[Pace], narrow: Pace) -> Finding:
    """The narrow one is run once, and taken to scatter in proportion as the wide one does."""
    wide_s = np.array(_seconds(wide))
    seen = Slots(float(wide_s.mean()), narrow.processor_s)
    means_s = _means(_drawn([list(wide_s), list(wide_s * narrow.processor_s / wide_s.mean())]))
    return _unless_busy(judge(SLOT_CLAIM, seen, [Slots(*map(float, each)) for each in means_s]), [*wide, narrow])


def _unless_busy(finding: Finding, paces: Sequence[Pace]) -> Finding:
    """Leave a claim of time open where other processes ran beside it, and tell the load."""
    cores = max(pace.others_cores for pace in paces)
    words = f"{finding.redrawn}; load by others {cores:.2f} cores at most"
    if cores <= QUIET_CORES:
        return replace(finding, redrawn=words)
    return replace(finding, redrawn=f"{words}: not judged", judgement="open")


def _means(values: Floats) -> Floats:
    """Means over the last axis, as another such sample may have had them: t-distributed about the found ones."""
    random, number = np.random.default_rng(3), values.shape[-1]
    doubt = values.std(axis=-1, ddof=1) / np.sqrt(number)
    return values.mean(axis=-1) + doubt * random.standard_t(number - 1, doubt.shape)


def _drawn(values: Sequence[Sequence[float]]) -> Floats:
    return np.broadcast_to(np.array(values), (SETS, len(values), len(values[0])))


def _seconds(paces: Sequence[Pace]) -> list[float]:
    return [pace.processor_s for pace in paces]


def _mean_s(paces: Mapping[float, Sequence[Pace]]) -> dict[float, float]:
    return {d_cm: float(np.mean(_seconds(runs))) for d_cm, runs in paces.items()}


def _straight(paces: Sequence[Pace]) -> float:
    """R² of the line through the frames in which anything moved; 0 where there are too few for one."""
    moving, frame_ms = (np.concatenate(each) for each in zip(*((p.moving, p.frame_ms) for p in paces), strict=True))
    line = pace_of(moving[moving > 0].astype(float), frame_ms[moving > 0])
    return 0.0 if line is None else line[2]
