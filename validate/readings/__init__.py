"""Caliper readings from a lab's sheets: CSV and XLSX as labs write them.

A file becomes cells (``samples``, ``text_table``, ``workbook``, ``sheet``), the cells get a header (``columns``,
``words``), and the rows below become stations (``table``); ``read_readings`` is the entry. A new arrangement of columns
is recognised in ``columns.read_header`` and collected in ``table.TableReader``; new header words
stand in ``words.toml``. Sheets of every form are written by ``tests/sheet_writers.py`` and read back in
``tests/validate/readings/``.
"""
