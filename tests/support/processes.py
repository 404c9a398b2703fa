"""Commands that a test calls in its own process."""

from typing import Any

from typer.main import get_command
from typer.testing import CliRunner, Result

from sealtwin.cli.app import app


def commands() -> dict[str, Any]:
    """Every command of the command line by its name, as in "material spread"."""
    groups: Any = get_command(app)
    return {
        f"{name} {inner}".strip(): command
        for name, group in groups.commands.items()
        for inner, command in getattr(group, "commands", {"": group}).items()
    }


def sealtwin(*arguments: object) -> Result:
    """Call the command in this process: another one imports for seconds."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def refusal(*arguments: object) -> str:
    """Errors of a command that must end with exit code 3, with a sentence and no traceback."""
    answer = sealtwin(*arguments)
    assert answer.exit_code == 3, answer.output
    assert any(line.startswith("sealtwin: ") for line in answer.stderr.splitlines())
    assert "Traceback" not in answer.output
    return answer.stderr.rstrip()
