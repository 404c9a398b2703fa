"""The one reader of files: what a folder may hold in place of a file is refused before it is opened."""

import os

import pytest

from sealtwin.core.errors import InputError
from sealtwin.core.files import read_json, sha256
from sealtwin.core.plain_files import opened, read_bytes, read_text

NO_FILES = {
    "a pipe, which waits for ever": (os.mkfifo, "a device or a pipe"),
    "a link to a device, which has no end": (lambda path: path.symlink_to("/dev/zero"), "a device or a pipe"),
    "a folder": (os.mkdir, "a folder"),
    "an endless sparse file": (lambda path: (path.touch(), os.truncate(path, 10**12)), "larger than"),
}


@pytest.mark.parametrize(("make", "words"), NO_FILES.values(), ids=NO_FILES)
def test_what_is_no_file_of_that_size_is_refused_unread(tmp_path, make, words):
    """Each reader would fill the memory, or wait; the last one is a reader of pieces."""
    path = tmp_path / "report.json"
    make(path)
    for read in (read_bytes, read_text, read_json, sha256):
        with pytest.raises(InputError, match=rf"report\.json: .*{words}"):
            read(path)
    with pytest.raises(InputError, match=words), opened(path):
        pass


def test_a_text_of_any_line_ends_and_with_a_mark_is_read_alike_and_a_missing_one_is_named(tmp_path):
    path = tmp_path / "text"
    with pytest.raises(FileNotFoundError, match=str(path)):
        read_bytes(path)
    path.write_bytes(b"\xef\xbb\xbfa = 1\r\nb = 2\rc = 3\n")
    assert read_text(path) == "a = 1\nb = 2\nc = 3\n"
