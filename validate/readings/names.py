"""Names of samples and of columns: what their words mean. Nothing is guessed: an unknown word leaves a name open."""

import re
import unicodedata

PART = re.compile(r"[^\W_]+|[^\w\s.-]")


def sample_key(sample: str) -> str:
    """Return a key that is the same for spellings that differ only in case, spaces, points, hyphens and underscores.

    A gap between two digits counts: 1-11 is not 11-1. Other marks count: P01' is not P01.
    """
    key = ""
    for part in PART.findall(unicodedata.normalize("NFKC", sample).casefold()):
        key += f"-{part}" if key[-1:].isdigit() and part[0].isdigit() else part
    return key
