"""Faults of the machine and of names: told by the file that the user knows, in letters that anything can show."""

import errno
import json
from pathlib import Path

import pytest

from sealtwin.core.errors import as_text, naming


def _full_disk():
    raise OSError(errno.ENOSPC, "No space left on device")


def _fails_on_a_temporary_file():
    raise PermissionError(errno.EACCES, "Permission denied", ".photos.123.csv")


@pytest.mark.parametrize("failing", [_full_disk, _fails_on_a_temporary_file])
def test_a_fault_of_the_machine_names_the_users_file(failing):
    """What has no name would end as a bug of ours, with a traceback."""
    with pytest.raises(OSError, match=r"photos\.csv") as fault, naming(Path("out/photos.csv")):
        failing()
    assert fault.value.filename == "out/photos.csv"


def test_a_name_that_is_not_utf8_can_be_told_in_json_and_on_a_page():
    odd = Path("a/caf\udce9.png")
    with pytest.raises(UnicodeEncodeError):
        json.dumps(str(odd), ensure_ascii=False).encode()
    assert as_text(odd) == "a/caf\\xe9.png"
    assert as_text(Path("a/café.png")) == "a/café.png"
