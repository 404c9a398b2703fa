"""The probability that a line is the crack: fitted on seven sets of photos, judged on the eighth, eight times.

    python -m benchmarks.line_verdict

The routes are kept (benchmarks/real_roads/routes.csv); line_verdict_routes makes them from the photos. The weights of
the product are those of a fit on all eight sets; the rows below judge each set by a fit without it. Most wrong routes
are made on purpose, so that a probability is that of a route among these, of which more than half are wrong.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.stats import binomtest

from benchmarks.line_verdict_routes import ROUTES
from benchmarks.table import Row, run_benchmark
from digitise.crack_path.candidates import MAX_UNLIKE
from digitise.crack_path.find_path import RIVAL
from digitise.crack_path.line_verdict import CONSTANT, DOUBTED, LAPSE, LIGHT, REFUSED, TAKEN, WEIGHTS
from sealtwin.core.records import Booleans, Floats

PENALTY = 1.0
"""Of the squared weights of inputs in units of their standard deviation."""
BINS = 5
CURVE = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)


@dataclass(frozen=True)
class Routes:
    """Routes, one a row, and the probability of each by a fit without its set."""

    sets: np.ndarray
    photos: np.ndarray
    kind: np.ndarray
    verdict: np.ndarray
    score: Floats
    unlike: Floats
    inputs: Floats

    @classmethod
    def kept(cls) -> "Routes":
        with ROUTES.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))

        def column(name: str) -> np.ndarray:
            return np.array([row[name] for row in rows])

        score, unlike = (np.array([float(text or "nan") for text in column(name)]) for name in ("score", "unlike"))
        inputs = np.column_stack([column(name).astype(float) for name in WEIGHTS])
        return cls(column("set"), column("photo"), column("kind"), column("verdict"), score, unlike, inputs)

    @property
    def clicked(self) -> Booleans:
        return ~np.char.startswith(self.kind, "found")


def fitted(inputs: Floats, right: Booleans) -> tuple[float, Floats]:
    """Return the constant and the weights with the largest likelihood, less the penalty."""
    mean, sd = inputs.mean(axis=0), inputs.std(axis=0)
    scaled = (inputs - mean) / sd

    def loss(b: Floats) -> float:
        p = probability(b[0], b[1:], scaled)
        return float(-np.log(np.where(right, p, 1 - p)).sum() + PENALTY * (b[1:] ** 2).sum() / 2)

    b = minimize(loss, np.zeros(1 + inputs.shape[1])).x
    return float(b[0] - (b[1:] * mean / sd).sum()), b[1:] / sd


def probability(constant: float, weights: Floats, inputs: Floats) -> Floats:
    return LAPSE + (1 - 2 * LAPSE) / (1 + np.exp(-(constant + inputs @ weights)))


def main() -> list[Row]:
    routes = Routes.kept()
    right, shade = routes.verdict != "wrong", routes.kind == "shade"
    of_fit = routes.clicked & ~shade
    probabilities = np.empty(len(right))
    for name in np.unique(routes.sets):
        others = of_fit & (routes.sets != name)
        probabilities[routes.sets == name] = probability(*fitted(routes.inputs[others], right[others]), routes.inputs)[
            routes.sets == name
        ]
    constant, weights = fitted(routes.inputs[of_fit], right[of_fit])
    print(
        f"fit on all sets: constant {constant:.3f}, weights", dict(zip(WEIGHTS, weights.round(3).tolist(), strict=True))
    )
    usual = np.median(routes.inputs[of_fit & (routes.verdict == "right")], axis=0)
    print("median of right routes:", dict(zip(WEIGHTS, usual.round(3).tolist(), strict=True)))
    wrong, traced = of_fit & ~right, of_fit & (routes.verdict == "right")
    true, light = routes.kind == "true", routes.inputs[:, list(WEIGHTS).index("light_beside")] > LIGHT
    print("\nlimit: wrong routes said, right routes with a caution (between true clicks), wrong of silent")
    for limit in sorted({*CURVE, DOUBTED}):
        cautioned = (probabilities < limit) | light
        silent = true & ~cautioned
        print(
            f"{limit:.2f}: {_percent(cautioned[wrong])}, {_percent(cautioned[traced])} "
            f"({_percent(cautioned[traced & true])}), {np.sum(silent & ~right)} of {np.sum(silent)}"
        )
    cautioned = (probabilities < DOUBTED) | light
    print("\nkind: wrong routes said, of")
    for kind in dict.fromkeys(routes.kind[wrong | shade].tolist()):
        of_kind = ~right & (routes.kind == kind)
        print(f"{kind}: {_percent(cautioned[of_kind])} of {of_kind.sum()}")
    differs = np.abs(np.array([CONSTANT, *(weight.weight for weight in WEIGHTS.values())]) - [constant, *weights]).max()
    silent = true & ~cautioned
    return [
        Row("weights of the product off the fit", float(differs), "", 0, 1e-3),
        Row(f"wrong routes said, of {wrong.sum()}", _share(cautioned[wrong]), "%", 90, 100),
        Row(f"right routes with a caution, of {traced.sum()}", _share(cautioned[traced]), "%", 0, 15),
        Row(f"right routes refused, of {traced.sum()}", _share(probabilities[traced] < REFUSED), "%", 0, 2),
        Row(f"wrong of silent, true clicks, of {silent.sum()}", _share(~right[silent]), "%", 0, 2),
        Row(
            f"bins of probability within 95 %, of {BINS}", float(reliable(probabilities[of_fit], right[of_fit])), "", 4
        ),
        *_taken(routes, probabilities),
    ]


def reliable(p: Floats, right: Booleans) -> int:
    """Return the number of bins of equal size whose mean probability is within the share's 95 % interval."""
    within = 0
    print("\nmean probability : share right, 95 % interval, routes")
    for rows in np.array_split(np.argsort(p, kind="stable"), BINS):
        interval = binomtest(int(right[rows].sum()), len(rows)).proportion_ci()
        mean = p[rows].mean()
        within += interval.low <= mean <= interval.high
        print(f"{mean:.3f} : {right[rows].mean():.3f}, {interval.low:.3f} to {interval.high:.3f}, {len(rows)}")
    return within


def _taken(routes: Routes, probabilities: Floats) -> Sequence[Row]:
    """Return the rows about photos without clicks: the first line is taken, or asked about."""
    first = routes.kind == "found 1"
    names = np.char.add(np.char.add(routes.sets, "/"), routes.photos)
    rivals = np.isin(names, names[~routes.clicked & ~first & (routes.score >= RIVAL)])
    taken = first & (probabilities >= TAKEN) & (routes.unlike <= MAX_UNLIKE) & ~rivals
    cracks = first & (routes.verdict != "wrong")
    return [
        Row(
            f"no clicks: taken and wrong, of {taken.sum()} taken of {first.sum()}",
            float((taken & ~cracks).sum()),
            "",
            0,
            5,
        ),
        Row(
            f"no clicks: first line a crack and taken, of {cracks.sum()}",
            100 * (taken & cracks).sum() / cracks.sum(),
            "%",
            50,
        ),
    ]


def _share(which: Booleans) -> float:
    return 100 * float(np.mean(which))


def _percent(which: Booleans) -> str:
    return f"{_share(which):.1f} %"


if __name__ == "__main__":
    run_benchmark(main)
