"""Caliper readings from a lab's sheets: CSV, XLSX and ODS as labs write them.

A file becomes cells (``samples``, ``text_table``, ``workbook``, ``open_document``, ``sheet``), the cells a table with a
header (``table_rows``, ``columns``), and the rows below become stations
(``stations``; ``read_readings`` is the entry). ``stand_ins`` lets reading go on if the columns are unknown.
To support a new arrangement of columns, extend ``columns.read_header`` and
``read_readings.TableReader``, with rows in ``READ`` and ``REFUSED`` of ``tests/validate/readings/test_columns.py``; new
words go into ``words.toml``, which ``header_words`` applies. ``screens`` and ``whole_sheet`` look for readings that may
be mistakes, and ``understood`` puts them into words. ``tests/sheet_writers.py`` and ``tests/open_document.py`` write
sheets for the tests in ``tests/validate/readings/``.
"""
