"""Programs for robots: one module per language, each a function from a ``RobotPath`` to text.

A new language takes its module here, its name, table and checks in ``cell.py`` (``Format``, ``RobotCell.missing_for``),
its file's name and writer in ``sealtwin/trial/robot_files.py`` (``NAMES``, ``_writers``), a table in
``sealtwin/templates/starter_cell.toml``, and an independent reader in ``tests/robot_readers.py``.
"""
