"""Study files: varied settings, checked for all runs before the first run starts."""

import pytest

from sealtwin.core.errors import InputError
from sealtwin.study.study_file import load_study, plan_runs
from sealtwin.trial.trial_file import load_trial
from tests.support.paths import FIXTURE
from tests.support.tiny_study import tiny_lab


def _plan(folder, varies):
    study = tiny_lab(folder, varies)
    return plan_runs(load_study(study), study, load_trial(folder / "trial.toml"))


def _values(planned, name):
    """Return the values of a setting in all runs."""
    table, _, key = name.rpartition(".")
    trials = [run.trial.model_dump() for run in planned]
    return [trial[table][key] if table else trial[key] for trial in trials]


@pytest.mark.parametrize(
    ("varies", "values"),
    [
        pytest.param(
            '[grid]\n"fluid.U" = [3, 30.0]\nfluid.D_cm = [0.1, 0.2, 0.3]\n',
            {"fluid.U": [3, 3, 3, 30, 30, 30], "fluid.D_cm": [0.1, 0.2, 0.3, 0.1, 0.2, 0.3]},
            id="a grid has all combinations in the given order",
        ),
        pytest.param(
            '[fixed]\nsolver.radius_mm = 0.5\n[list]\ncolumns = ["seed"]\nrows = [[1], [2]]\n',
            {"solver.radius_mm": [0.5, 0.5], "seed": [1, 2], "fluid.freeze_after_s": [0.2, 0.2]},
            id="fixed settings are those of all runs",
        ),
        pytest.param(
            '[grid]\n"fluid.viscosity_pa_s" = [1.0, 5.0]\n',
            {"fluid.viscosity_pa_s": [1.0, 5.0], "fluid.U": [None, None], "fluid.D_cm": [None, None]},
            id="a viscosity replaces U and D of the trial",
        ),
    ],
)
def test_planned_runs_have_the_varied_and_fixed_values(tmp_path, varies, values):
    planned = _plan(tmp_path, varies)
    assert [run.number for run in planned] == [*range(1, len(planned) + 1)]
    assert {name: _values(planned, name) for name in values} == values


def test_each_fault_of_a_study_is_listed_once_with_its_runs_and_value(tmp_path):
    with pytest.raises(InputError) as caught:
        _plan(tmp_path, '[grid]\n"fluid.U" = [3, -30, 1e9]\n"fluid.D_cm" = [0.1, "much"]\n')
    lines = str(caught.value).splitlines()
    assert len(lines) == 3
    assert "runs 2, 4, 6: " in lines[0]
    assert "fluid.D_cm = 'much': should be a number." in lines[0]
    assert "runs 3, 4: " in lines[1]
    assert "fluid.U = -30: should be at least 0." in lines[1]
    assert "fluid.U = 1000000000.0: should be at most 1000000." in lines[2]


@pytest.mark.parametrize(
    ("varies", "sentence"),
    [
        ("", "give either [grid] or [list] for the settings that vary"),
        ('[grid]\n"fluid.u" = [1]', "fluid.u: no such setting; the most similar name is 'fluid.U'"),
        ('[grid]\n"photo.file" = ["a"]', "photo.file: no such setting; expected seed or a key of [fluid]"),
        ('[grid]\n"fluid.U" = []', "grid.fluid.U: the list of values is empty"),
        ('[grid]\n"fluid.U" = [1]\nfluid.U = [2]', "fluid.U is given twice"),
        ('[fixed]\nseed = 3\n[grid]\nseed = [1]', "seed: given twice"),
        ('[list]\ncolumns = ["fluid.U", "seed"]\nrows = [[1.0, 2], [1.0]]', "row 2 has 1 values, but columns has 2"),
        ('[list]\ncolumns = ["seed"]\nrows = [[4], [5], [4]]', "runs 1 and 3 have the same settings"),
        ("[grid]\nseed = [" + ",".join(str(n) for n in range(200)) + "]\n"
         "solver.iterations = [" + ",".join(str(n) for n in range(200)) + "]", "40000 runs, but at most 20000 are"),
    ],
)  # fmt: skip
def test_an_invalid_study_file_is_refused_with_the_reason(tmp_path, varies, sentence):
    with pytest.raises(InputError) as caught:
        _plan(tmp_path, varies)
    assert sentence in str(caught.value)
    assert "study.toml" in str(caught.value)


def test_the_shipped_study_has_the_132_combinations_of_the_paper():
    file = FIXTURE / "study-paper.toml"
    study = load_study(file)
    planned = plan_runs(study, file, load_trial(FIXTURE / study.trial))
    assert len(planned) == 132
    u, d = ([run.settings[name] for run in planned] for name in ("fluid.U", "fluid.D_cm"))
    assert (min(u), max(u), min(d), max(d)) == (1e-2, 1e4, 1e-4, 3)  # paper, 3.2.4
    # The chosen, the best and the worst settings of the paper are among them.
    assert {(30, 0.3), (30, 3), (0.03, 1e-4)} <= set(zip(u, d, strict=True))
