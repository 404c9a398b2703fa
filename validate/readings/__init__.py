"""Caliper readings from a lab's sheets: CSV, XLSX and ODS as labs write them.

A file becomes cells (``samples``, ``text_table``, ``workbook``, ``open_document``, ``sheet``), the cells a table with a
header (``table_rows``, ``columns``), and the rows below become stations (``read_readings``, the entry). A new
arrangement of columns is recognised in ``columns.read_header`` and collected in ``read_readings.TableReader``; new
words stand in ``words.toml``, which ``header_words`` applies. What may not have been meant is found by ``screens`` and
``whole_sheet``, and put into words by ``understood``. Sheets of every form are written by
``tests/sheet_writers.py`` and ``tests/open_document.py``, and read back in ``tests/validate/readings/``.
"""
