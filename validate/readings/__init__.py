"""Caliper readings from a lab's sheets: CSV and XLSX.

``grid`` reads the cells of a file. ``table`` finds the header, and the columns by their names (``words``). ``rows``
reads the stations. ``beside`` asks about each text next to them that is not plainly harmless. ``reading_checks``
asks about readings that may be mistakes. ``read_readings`` is the entry point.

One form of sheet is read: a header of one to three rows, one sample, and a row for each station, or a row for each
reading with a column that counts repeats. Everything else leads to a question. For a new form of sheet, add a question,
not a reader. New words belong in ``words.toml``. Tests are tables of sheets in ``tests/validate/readings/``.
"""
