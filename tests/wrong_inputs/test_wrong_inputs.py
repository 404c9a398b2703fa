"""Each wrong input of the tables is given to its command."""

import shlex

import pytest

from tests.support.ingested_lab import sealtwin
from tests.wrong_inputs import digitise, lab, material, options, photos, processes, readings
from tests.wrong_inputs.table import REFUSED, WrongInput

TABLES = {
    table.__name__.rpartition(".")[2]: table.CASES
    for table in (digitise, lab, material, options, photos, processes, readings)
}
ROWS = [pytest.param(row, id=f"{stage}: {row.name}") for stage, rows in TABLES.items() for row in rows]


@pytest.mark.parametrize("row", ROWS)
def test_the_answer_to_a_wrong_input_names_the_fault(row: WrongInput, tmp_path):
    given, out = tmp_path / "given", tmp_path / "out"
    given.mkdir()
    row.make(given)
    words = [word.format(given=given, out=out) for word in shlex.split(row.command)]
    answer = sealtwin(*words)
    assert answer.exit_code == row.code, answer.output
    assert [name for name in row.names if name not in answer.output] == [], answer.output
    assert [word for word in row.lacks if word in answer.output] == [], answer.output
    if row.code == REFUSED:
        assert "Traceback" not in answer.output
        # The result for a folder is the table of its samples.
        assert answer.stdout == "" or words[0] == "ingest", "a refusal has no result"
