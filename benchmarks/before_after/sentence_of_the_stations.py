"""The number of stations outside their bands by chance: an answer must say what that number rests on."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

fixture = Path("fixtures/paper-trial")
text = (fixture / "trial.toml").read_text(encoding="utf-8").replace('preset = "accurate"', 'model = "slot"')
with tempfile.TemporaryDirectory() as place:
    trial = Path(place, "trial.toml")
    for name in ("photo.jpg", "caliper.csv"):
        text = text.replace(f'"{name}"', f'"{(fixture / name).resolve()}"')
    trial.write_text(text.replace("radius_mm = 0.4\n", ""), encoding="utf-8")
    command = [sys.executable, "-m", "sealtwin", "run", trial, "--out", Path(place, "run"), "--quiet"]
    subprocess.run(command, capture_output=True, check=False)
    comparison = json.loads(Path(place, "run", "comparison.json").read_text(encoding="utf-8"))
sentence = next(one for one in comparison["uncertainty"]["sentences"] if "chance" in one)
said = sentence[sentence.index(". ") + 2 :]
sound = "if the budget of errors (mostly common shift of the stations) is complete" in sentence
print(json.dumps({"line": said, "sound": sound}))
