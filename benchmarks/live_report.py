"""The fast model on a report's page against the command on the trial files that the page writes, at 20 settings.

    python -m benchmarks.live_report [--out DIR]

Five settings of a Latin hypercube over the sliders of each of four trials, all of the reconstructed photo: a paste
between the shipped trial's walls; a thinning paste between walls that close, by cross-section, on a slope; a leaning
crack that is run backwards with ramps and leads; and an upright one that is overfilled. Chromium is what 'make
test-browser' installs. Updates are counted by the processor's time of the page's own thread, which a busy machine does
not lengthen.
"""

import importlib
import shutil
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy.stats import qmc
from typer import Option

from benchmarks.paper_trial import FIXTURE
from benchmarks.table import Row, run_benchmark
from sealtwin.core.progress import Progress
from sealtwin.trial.job import STAGES
from sealtwin.trial.pipeline import run_trial
from sealtwin.trial.trial_file import load_trial
from tests.live_page import level_mm, move, poured, write_changed

FAST = (
    ("[solver]\n", '[solver]\nmodel = "slot"\n'),
    ("freeze_after_s = 2.58", 'yield_stress_pa = 12.0\nfreeze_after_s = "never"'),
)
"""Changes of all: the fast model has no freezing."""
HERSCHEL_BULKLEY = ("U = 30.0\nD_cm = 0.3", "consistency_pa_s_n = 0.8\nflow_index = 0.6")
WALLS = 'tilt = "flare"\nwall_angle_deg = 5.5'
TRIALS = {
    "flaring": (),
    "closing": (
        HERSCHEL_BULKLEY,
        (WALLS, 'tilt = "funnel"\nwall_angle_deg = 6.0'),
        ("[path]\nvolume_ml = 4.8", '[sample]\ngradient_deg = 4.0\n\n[path]\nvolume_ml = 1.6\nflow = "cross_section"'),
    ),
    "leaning": (
        ("U = 30.0\nD_cm = 0.3", "viscosity_pa_s = 0.5"),
        (WALLS, 'tilt = "lean"'),
        ("trim_mm = 10.0", "trim_mm = 10.0\nreverse = true\nramp_mm = 3.0\nlead_in_mm = 5.0\nlead_out_mm = 5.0"),
        ("volume_ml = 4.8", "volume_ml = 2.4"),
        ("yield_stress_pa = 12.0", "yield_stress_pa = 3.0"),
    ),
    "overfilled": ((WALLS, 'tilt = "vertical"'), ("settle_s = 2.0", "settle_s = 20.0")),
}
"""Changes of the fixture's trial file by trial."""
SETTINGS, SEED, UPDATES = 5, 16, 40
SLIDERS = ("flow_mm3_s", "speed_mm_s", "yield_stress_pa", "mean_width_mm")
MOST_OFF_MM, LEAST_PER_S, LARGEST_MB = 0.01, 10.0, 3.0  # The issue's


def main(out: Annotated[Path, Option(help="where the run folders go")] = Path("reports", "live")) -> list[Row]:
    executable = shutil.which("chromium")
    if executable is None:
        raise SystemExit("no chromium on the PATH; 'make test-browser' installs it")
    off_mm: list[float] = []
    unfit, asked, largest_mb, per_s = 0, 0, 0.0, np.inf
    playwright: Any = importlib.import_module("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=executable, args=["--no-sandbox", "--disable-gpu"])
        for number, (name, changes) in enumerate(TRIALS.items()):
            page_file = _report(out / name.replace(" ", "-"), changes)
            largest_mb = max(largest_mb, page_file.stat().st_size / 1e6)
            page, visited = browser.new_page(), []
            page.on("request", lambda request, visited=visited: visited.append(request.url))
            page.goto(page_file.resolve().as_uri())
            for shares in qmc.LatinHypercube(len(SLIDERS), seed=SEED + number).random(SETTINGS):  # pyright: ignore[reportCallIssue]
                move(page, dict(zip(SLIDERS, shares.tolist(), strict=True)))
                lab = page_file.parents[1]
                run, profile = poured(write_changed(page, lab / "changed.toml"), lab / f"changed-{len(off_mm)}")
                assert run.fast_fill is not None
                unfit += bool(run.unfit)
                off_mm.append(float(np.abs(level_mm(page) - profile.level_mm).max()))
                print(f"{name:<12} off by {off_mm[-1]:.6f} mm, page against command", flush=True)
            per_s = min(per_s, _updates_per_s(page))
            asked += sum(not url.startswith("data:") for url in visited) - 1
            page.close()
    rows = [
        Row(f"largest difference of the level at {len(off_mm)} settings", max(off_mm), "mm", 0, MOST_OFF_MM),
        Row("settings outside the model's domain", unfit, ""),
        Row("updates, of the slowest page's thread", per_s, "/s", LEAST_PER_S),
        Row("largest page", largest_mb, "MB", 0, LARGEST_MB),
        Row("requests beside the page itself", asked, "", 0, 0),
    ]
    return rows


def _report(lab: Path, changes: tuple[tuple[str, str], ...]) -> Path:
    """Run a changed trial of the fixture, and return the page of its report."""
    shutil.copytree(FIXTURE, lab, dirs_exist_ok=True)
    text = (FIXTURE / "trial.toml").read_text(encoding="utf-8")
    for old, new in (*FAST, *changes):
        if old not in text:
            raise RuntimeError(f"{FIXTURE / 'trial.toml'}: has no {old!r}")
        text = text.replace(old, new)
    (lab / "trial.toml").write_text(text, encoding="utf-8")
    run_trial(load_trial(lab / "trial.toml"), lab, lab / "out", STAGES, "cpu", Progress())
    return lab / "out" / "report.html"


def _updates_per_s(page: Any) -> float:
    """Updates in a second of the processor's time of the page's thread, settings, picture and all."""
    thread = page.context.new_cdp_session(page)
    thread.send("Performance.enable", {"timeDomain": "threadTicks"})

    def busy_s() -> float:
        metrics = thread.send("Performance.getMetrics")["metrics"]
        return next(float(one["value"]) for one in metrics if one["name"] == "TaskDuration")

    before_s = busy_s()
    for number in range(UPDATES):
        move(page, {"yield_stress_pa": number / UPDATES})
    return UPDATES / (busy_s() - before_s)


if __name__ == "__main__":
    run_benchmark(main)
