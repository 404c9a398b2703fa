"""Caliper readings from a lab's sheets: CSV and XLSX as labs write them.

A file becomes cells (``samples``, ``text_table``, ``workbook``, ``sheet``), the cells get a header (``columns``), and
the rows below become stations (``read_readings``, the entry). A new arrangement of columns is recognised in
``columns.read_header`` and collected in ``read_readings.TableReader``; new header words stand in ``words.toml``.
What may not have been meant is found by ``screens``, ``copies`` and ``whole_sheet``, and put into words by ``doubts``.
Sheets of every form are written by ``tests/sheet_writers.py`` and read back in ``tests/validate/readings/``.
"""
