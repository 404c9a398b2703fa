"""Blocks of the report's template: texts from a user, and missing values."""

import jinja2
import pytest

from validate.sentences import sentence, table


def test_a_text_of_a_user_is_not_interpreted_and_stays_on_one_line():
    """A text has neither a row nor a part of its own in a table."""
    hostile, text = "{{ 7 * 7 }} ␞{% raw %}\n</p>␟ | a", "{{ 7 * 7 }} {% raw %} </p> | a"
    assert sentence("assumed.note", text=hostile) == f"Note of the digitising stage: {text}"
    assert table("table_origin", origin={hostile: hostile}).rows == ((text, text),)


def test_a_missing_value_of_a_sentence_raises_an_error():
    """Seen to fail with jinja2's default, which prints nothing."""
    with pytest.raises(jinja2.UndefinedError, match="'by_chance' is undefined"):
        sentence("validation.stations", value=1, count=2, high=1, above=1)
