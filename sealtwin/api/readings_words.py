"""Words of messages about readings for Python: settings are keywords, and there is no trial or pairing file."""

import re
from typing import Literal

Given = Literal["file", "named rows", "array"]
"""Input of ``read_readings``: a file, rows with the names of their columns, or numbers without names."""

NAME_THEM = 'Name them as a sheet does, such as "s_mm", "depth_1_mm", and leave out other columns of numbers.'
TABLE = r"Write into the column range of its row.*?the cells of "
OTHER_TABLE = r" Add a row of this file for the other, with its sample or the role ignore\."
PHRASES: dict[Given, tuple[tuple[str, str], ...]] = {
    "file": (
        (
            r"Assign the columns by letters:.*? or the trial\.",
            'Assign the columns by letters: columns={"s": "A", "levels": ["B", "C"]}.',
        ),
        (TABLE, 'Give columns, key "range": the cells of '),
        (OTHER_TABLE, ""),
        (r"Write into the column places of pairing\.csv:", 'Give columns, key "places":'),
        (r"\[readings\.columns\] (\w+) = (\"[^\"]*\")", r'columns={"\1": \2}'),
        (r"\[readings\.columns\] (\w+)", r'columns, key "\1"'),
    ),
    "named rows": (
        ("; read as CSV, UTF-8, semicolons", ""),
        (r"Assign the columns by letters:.*? in a copy\.", NAME_THEM),
        (r"List the columns of readings: \[readings\.columns\] levels", "Leave out columns that are not readings"),
        (r"List the columns to read in \[readings\.columns\] levels", "Leave out one kind"),
        (TABLE, "Give only the columns of "),
        (OTHER_TABLE, ""),
        (r"Write into the column places of pairing\.csv:.*?all places\.", "Give the places as numbers in mm."),
        (r"add it to \[readings\.columns\] missing", "use None"),
        (r"Skip these rows with \[readings\.columns\] skip", "Leave out these rows"),
        (r"\[readings\.columns\] s_from = \"second\"", "reverse the rows' s"),
        (r"set \[readings\] sheet or \[readings\.columns\] range", "give other rows"),
        (
            r"set \[readings\.columns\] repeat = (\"[^\"]*\")?",
            "give the readings of a station in one row",
        ),
        (r"Correct \[readings\.columns\] header_rows; rows are counted.*?spreadsheet", "Correct header_rows"),
    ),
    "array": (
        ("Correct the header: level counts", 'Set quantity: "level" counts'),
        ("from the face, depth downward", 'from the face, "depth" downward'),
        ("Correct the unit in the header", "Convert the readings to mm"),
    ),
}
"""Pattern of each phrase about a sheet, with the words for what was given."""
OF_ALL = (
    (r"Write the one to read into the trial, such as ", "Select one: "),
    (r", or (sign )?in pairing\.csv(: up or down| \(one row for each sample\))?", ""),
    (r"\[readings\] ", ""),
    (r"\breadings\.(as_written|unit|sample|sheet|decimal)\b", r"\1"),
)
"""The same for everything that ``read_readings`` reads. These come last."""


def for_python(text: str, given: Given) -> str:
    """Return a message about readings in the words of ``read_readings``."""
    for pattern, words in (*PHRASES[given], *OF_ALL):
        text = re.sub(pattern, words, text)
    return text
