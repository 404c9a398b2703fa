"""Results of one solver in the hands of another one of the same version: they must be made anew, refused, or named.

What is named must stand in the answer itself: ``--quiet`` hides the narration.

A copy of the tree has another law of viscosity and, if its stages have numbers, the next number.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.studies import tiny_lab

TREE, PACKAGES = Path.cwd(), ("digitise", "simulate", "validate", "sealtwin", "benchmarks", "tests", "fixtures")
GRID = '[grid]\n"fluid.U" = [3.0, 300.0]\n'


def change(path: Path, pattern: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    path.write_text(re.sub(pattern, new, text), encoding="utf-8")


def call(tree: Path, *words: object) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(tree)}
    command = [sys.executable, *map(str, words)]
    return subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, check=False)


with tempfile.TemporaryDirectory() as place:
    lab, other = Path(place) / "lab", Path(place) / "other"
    for package in PACKAGES:
        shutil.copytree(TREE / package, other / package, ignore=shutil.ignore_patterns("__pycache__"))
    change(other / "simulate" / "setup" / "rheology.py", r"\nLAW = 0\.1185\n", "\nLAW = 0.3\n")
    for stage in ("digitise", "simulate"):
        change(other / stage / "__init__.py", r"\nSTAGE_NUMBER = .+", "\nSTAGE_NUMBER = 999")
    study = tiny_lab(lab, GRID)
    call(TREE, "-m", "sealtwin", "robot", "--example", lab / "cell.toml")
    text = (lab / "trial.toml").read_text(encoding="utf-8").split("[readings]")[0]
    (lab / "trial.toml").write_text(text.replace("U = 30.0\nD_cm = 0.3", "viscosity_pa_s = 1.0"), encoding="utf-8")
    (lab / "study.toml").write_text(study.read_text().replace('"fluid.U"', '"fluid.viscosity_pa_s"'))
    sweep = ("-m", "sealtwin", "sweep", study, "--out", lab / "sweep", "--jobs", 1, "--device", "cpu")
    run = ("-m", "sealtwin", "run", lab / "trial.toml", "--device", "cpu", "--out")
    for words in ((*run, lab / "run"), sweep):
        made = call(TREE, *words)
        assert made.returncode == 0, made.stderr
    loop, tables = ("-m", "sealtwin", "loop", lab), "from tests.sealtwin.plan.test_make_loop import log_of"
    made = call(TREE, "-c", f"from pathlib import Path; {tables}; log_of(Path({str(lab)!r}))")
    assert made.returncode == 0, made.stderr
    shutil.copytree(lab / "run", lab / "old")
    level = (lab / "run" / "profile.csv").read_bytes()
    answers = {
        "status": call(other, "-m", "sealtwin", "sweep", "status", lab / "sweep", "--quiet"),
        "validate": call(other, "-m", "sealtwin", "validate", lab / "old", "--quiet"),
        "robot": call(other, "-m", "sealtwin", "robot", lab / "old", "--cell", lab / "cell.toml", "--quiet"),
        "loop --replay": call(other, *loop, "--replay", lab / "loop-1.jsonl", "--quiet"),
    }
    read = call(other, "-c", f"import sealtwin as st; st.read_loop({str(lab)!r})")
    again, continued = call(other, *run, lab / "run"), call(other, *sweep)
    by_another = call(other, *run, lab / "new")
    compared = call(other, "-m", "sealtwin", "compare", lab / "old", lab / "new", "--out", lab / "page", "--json")
    kept = call(other, "-m", "benchmarks.slumps")
    content = json.loads(compared.stdout) if compared.stdout.startswith("{") else {}
    found = {
        "a run": (lab / "run" / "profile.csv").read_bytes() != level,
        "a study": "made anew" in continued.stderr,
        "a comparison": bool(content.get("differing")),
        **{f"the answer of {name}": "while this version has" in answer.stdout for name, answer in answers.items()},
        "st.read_loop": "while this version has" in read.stderr,
        "kept runs": kept.returncode != 0 and "targets met" not in kept.stdout,
    }
    assert again.returncode == by_another.returncode == continued.returncode == 0, again.stderr + by_another.stderr
missed = [name for name, noticed in found.items() if not noticed]
line = f"not noticed by {', '.join(missed)}" if missed else f"noticed by {', '.join(found)}"
print(json.dumps({"line": f"another solver: {line}", "sound": not missed}))
