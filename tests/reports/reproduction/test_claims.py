"""The paper's claims agree with results like the paper's and disagree with contradicting results."""

from dataclasses import replace

import numpy as np
import pytest

from reports.reproduction.claims import claims_of
from reports.reproduction.runs import Results

U = [0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100, 300, 1000, 10000]
D_CM = [1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 0.6, 1, 3]


def paper_errors_mm() -> np.ndarray:
    """Mean errors of the paper's shape, (12, 11): a row for each U.

    The errors are constant for U below 1, fall up to 100 and rise beyond; a D from 0.03 cm on lowers them, mostly for
    U from 1 to 100. A ridge at D = 0.003 cm separates the accurate pairs into two regions.
    """
    u, d_cm = np.meshgrid(U, D_CM, indexing="ij")
    error_mm = np.interp(np.log10(u), (-2, 0, 1, 2, 4), (3.3, 3.3, 2.0, 1.45, 1.8))
    reach_mm = np.where((u > 1) & (u < 100), 0.25, 0.04)
    error_mm -= reach_mm * np.interp(np.log10(d_cm), (-3, np.log10(0.3)), (0, 1))
    error_mm += np.where((u > 10) & (d_cm == 3e-3), 0.6, 0.0)
    error_mm += np.where((u > 100) & (d_cm == 0.6), 0.1, 0.0)
    error_mm[U.index(30), D_CM.index(3)] = 1.24
    error_mm[U.index(30), D_CM.index(0.3)] = 1.26
    error_mm[U.index(0.03), 0] = 3.45
    return error_mm


def paper_results() -> Results:
    size = {"particles": 14_527, "frames": 2076}
    return Results(
        computed_by="nothing",
        u=U,
        d_cm=D_CM,
        error_mm=paper_errors_mm().tolist(),
        run_s=360.0,
        volume_ratio=[1.0, 1.0],
        chosen={
            "mean_error_mm": 1.26,
            "worst_error_mm": 5.0,
            "worst_at_mm": 0.0,
            "share_under_1_mm": 0.75,
            "bins_mm": [4.2, 1.2, 0.6, 0.6, 0.6, 0.1, 0.6, 0.6],
            "level_20_to_30_mm": -4.0,
            "level_from_40_mm": 1.0,
        },
        baselines_mm={"a flat line": 3.69, "a straight line": 1.86, "a parabola": 0.59},
        frame_r2=0.99,
        eta_error_mm=[1.26, 1.26, 1.27],
        freezing_error_mm=[1.26, 2.0, 3.86],
        freezing_sd_mm=[4.0, 3.0, 1.0],
        unfrozen_mm=3.86,
        leaning={"mean_error_mm": 1.3, "volume_ratio": 1.0, "density_error_p95": 0.1},
        printed=[{"mean_error_mm": 1.26}, {"mean_error_mm": 1.26, "density_error_p95": 0.4}],
        times={
            "explicit": [{"processor_s": each, **size} for each in (10.0, 10.0, 20.0)],
            "implicit": [{"processor_s": each, **size} for each in (10.0, 10.0, 20.0)],
            "straight": [{"processor_s": 10.0, **size}, {"processor_s": 90.0, **size}],
        },
    )


def disagreeing(results: Results) -> list[str]:
    return [claim.name for claim in claims_of(results) if not claim.agrees]


def test_every_claim_agrees_with_results_like_those_of_the_paper():
    assert disagreeing(paper_results()) == []


def with_errors(change) -> Results:
    """Results whose mean errors in mm, (12, 11), are changed by a function of U, D in cm, and the errors."""
    error_mm = change(*np.meshgrid(U, D_CM, indexing="ij"), paper_errors_mm())
    return replace(paper_results(), error_mm=error_mm.tolist())


def with_chosen(**figures) -> Results:
    return replace(paper_results(), chosen=paper_results().chosen | figures)


def with_time(way: str, last_s: float) -> Results:
    times = paper_results().times
    *others, last = times[way]
    return replace(paper_results(), times=times | {way: [*others, last | {"processor_s": last_s}]})


WRONG = {
    "mean error of the chosen pair": with_chosen(mean_error_mm=1.6),
    "its mean level": with_chosen(level_from_40_mm=-0.1),
    "its largest error": with_chosen(worst_error_mm=6.1),
    "where its error is largest": with_chosen(worst_at_mm=75.0),
    "drop of its error": with_chosen(bins_mm=[4.2, 2.2, 0.6, 0.6, 0.6, 0.1, 0.6, 0.6]),
    "length with less": with_chosen(share_under_1_mm=0.64),
    "pieces of 10 mm": with_chosen(bins_mm=[4.2, 1.2, 1.1, 1.1, 0.6, 0.1, 0.6, 0.6]),
    "less than 1 mm all the way": with_chosen(bins_mm=[4.2, 0.9, 0.6, 0.6, 0.6, 0.1, 0.6, 1.1]),
    "least error of a piece": with_chosen(bins_mm=[4.2, 1.2, 0.6, 0.6, 0.6, 0.45, 0.6, 0.6]),
    "where its error is least": with_chosen(bins_mm=[4.2, 1.2, 0.6, 0.6, 0.1, 0.6, 0.6, 0.6]),
    "least mean error of all": with_errors(lambda u, d_cm, error_mm: error_mm + 0.4),
    "nearest pair": with_errors(lambda u, d_cm, error_mm: np.where((u == 1000) & (d_cm == 3), 1.0, error_mm)),
    "mean error of the chosen pair less": with_errors(lambda u, d_cm, error_mm: np.where(u == 100, 1.1, error_mm)),
    "largest mean error": with_errors(lambda u, d_cm, error_mm: 0.8 * error_mm),
    "farthest pair": with_errors(lambda u, d_cm, error_mm: np.where((u == 1e4) & (d_cm == 3), 3.5, error_mm)),
    "accurate regions": with_errors(lambda u, d_cm, error_mm: np.where((u > 10) & (d_cm == 3e-3), 1.5, error_mm)),
    "the chosen pair is robust": with_errors(lambda u, d_cm, error_mm: np.where(u == 100, 2.5, error_mm)),
    # The mean over D still rises beyond U = 100.
    "U, at each D": with_errors(lambda u, d_cm, error_mm: np.where((u > 100) & (d_cm == 3), 1.2, error_mm)),
    "a large D": with_errors(lambda u, d_cm, error_mm: np.where((u < 1) & (d_cm >= 0.3), 2.9, error_mm)),
    "D, mean of all U": with_errors(lambda u, d_cm, error_mm: np.where(d_cm < 5e-4, error_mm + 0.3, error_mm)),
    "error fluctuates": with_errors(lambda u, d_cm, error_mm: np.where(u > 100, 1.6, error_mm)),
    "effect of eta": replace(paper_results(), eta_error_mm=[1.1, 1.26, 1.35]),
    "flatter with fewer": replace(paper_results(), freezing_sd_mm=[4.0, 1.0, 3.0]),
    "the simulation fails": replace(paper_results(), freezing_error_mm=[1.26, 1.2, 1.2]),
    "slower for D above 1 cm, with Eq. 5 in passes": with_time("explicit", 14.0),
    "slower for D above 1 cm, with one solve": with_time("implicit", 14.0),
    "time of a frame": replace(paper_results(), frame_r2=0.85),
    "time of a crack": with_time("straight", 140.0),
    "the scheme as printed": replace(paper_results(), printed=[{"reason": "No."}, *paper_results().printed[1:]]),
}


@pytest.mark.parametrize("start", WRONG)
def test_each_claim_disagrees_with_contradicting_results(start):
    assert any(name.startswith(start) for name in disagreeing(WRONG[start]))


def test_the_contradicting_results_cover_every_claim():
    names = {claim.name for claim in claims_of(paper_results())}
    assert names == {name for results in WRONG.values() for name in disagreeing(results)}
