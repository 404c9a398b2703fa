"""The caps of sizes: what is counted, and that a size above its cap fails."""

import subprocess

import pytest

from tests.house_sizes import listed, main, sizes_of, tokens_of

MODULE = f'''"""A docstring."""

TEXT = "short"  # A comment
LONG = "{100 * "x"}"


def area(width):
    """Another."""
    return width * 2.0
'''


@pytest.fixture
def tree(tmp_path):
    for name, text in {
        "digitise/walls.py": MODULE,
        "validate/words.toml": "a = 1\n",
        "validate/figure.svg": "<svg/>",
        "sealtwin/trial.schema.json": "{}",
        "tests/test_walls.py": "x = 1\ny = 2\n",
        "benchmarks/speed.py": "x = 1\n",
        "docs/page.md": "# Three words\n",
        "left.md": "not counted",
        ".gitignore": "left.md\n",
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    return tmp_path


def test_a_string_counts_by_its_length_and_a_docstring_or_comment_not_at_all():
    assert tokens_of('"""Words."""\n# why\n') == 0
    # TEXT = 1; LONG = 1 + 102 // 40; def area ( width ) : return width * 2.0
    assert tokens_of(MODULE) == 3 + (2 + 1 + 102 // 40) + 10


def test_a_size_counts_what_git_lists(tree):
    assert sizes_of(tree, listed(tree)) == {
        "package_tokens": tokens_of(MODULE),
        "package_data_bytes": 6,
        "package_files": 1,
        "test_lines": 2,
        "benchmark_lines": 1,
        "markdown_words": 3,
    }


@pytest.mark.parametrize(("cap", "code"), [(2, 0), (1, 1)])
def test_a_size_above_its_cap_fails(tree, capsys, cap, code):
    (tree / "pyproject.toml").write_text(f"[tool.house]\nbenchmark_lines = 1\ntest_lines = {cap}\n")
    assert main(tree) == code
    benchmarks, tests = capsys.readouterr().out.splitlines()
    assert (benchmarks.endswith("ABOVE"), tests.endswith("ABOVE")) == (False, bool(code))
