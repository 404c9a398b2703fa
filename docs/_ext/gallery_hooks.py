"""What the gallery does before each example."""

import builtins
from pathlib import Path
from typing import Any

EXAMPLES = Path(__file__).parents[2] / "examples"


def name_file(conf: dict[str, Any], example: str) -> None:
    """Give an example its ``__file__``, which sphinx-gallery does not define and the examples find their data by."""
    vars(builtins)["__file__"] = str(EXAMPLES / Path(example).name)
