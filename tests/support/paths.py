"""Where the checkout and its fixture lie, whatever folder a test is in."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
FIXTURE = ROOT / "fixtures" / "paper-trial"
