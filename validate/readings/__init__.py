"""Caliper readings from a lab's sheets: CSV, XLSX and ODS.

``grid`` reads the cells of a file, ``table`` finds its header and its columns by their names (``words``), and ``rows``
reads the stations. ``beside`` asks about each text beside these that is not known to be harmless, and ``screens`` about
readings that may be mistakes. ``read_readings`` is the entry.

One shape is read: a header of one to three rows, a row for each station, or for each reading with a column that counts
repeats, and one sample. All else is asked: to a new form belongs a question, not a reader. New words go into
``words.toml``. A new quantity beside the readings, such as the humidity, is a member of ``words.Role`` and a table of
words, units and limits in ``words.toml``: its columns are then known, values outside the limits are asked about, and
its mean is in comparison.json and on the first page of report and PDF. Tests are tables of sheets in
``tests/validate/readings/``.
"""
