"""The demo of a photo of a real crack."""

import json

from sealtwin.trial.starter_files import DEMO, REAL
from tests.support.processes import sealtwin


def test_the_real_demo_fits_the_fast_model_and_warns_only_of_what_is_assumed(tmp_path):
    """The scale of the photo is invented: it is the one warning, beside the list of all that was assumed."""
    answer = sealtwin("demo", "--real", "--out", tmp_path / "demo", "--json")
    assert answer.exit_code == 0, answer.output
    result = json.loads(answer.stdout)
    assert result["fluid"]["unfit"] == []
    assert [fact["key"] for fact in result["sample"]["warnings"]] == ["scale.assumed"]
    assert len(result["assumed"]) == 6
    assert result["comparison"] is None
    assert {path.name for path in (tmp_path / "demo" / "trial").iterdir()} == set(DEMO[REAL])
    page = (tmp_path / "demo" / "run" / "report.html").read_text(encoding="utf-8")
    assert "Özgenel" in page
    assert "CC BY 4.0" in page
