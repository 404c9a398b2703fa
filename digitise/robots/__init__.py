"""Programs for robots: one module per language, each a function from a ``RobotPath`` to text.

To add a language, add

- its module here;
- its name, table and checks to ``cell.py``: ``Format``, a class of settings, its field and ``missing_for`` in
  ``RobotCell``; and its limits of flow, speed or start, if its dispenser has any, to ``RobotCell.steady_settings``,
  ``plan.shape.limits_of`` and ``robot_path.place_path``;
- its file's name and writer to ``PROGRAMS`` of ``sealtwin/trial/robot_files.py``, a table to
  ``sealtwin/templates/starter_cell.toml``, and the help of ``--format`` in
  ``sealtwin/cli/trials.py``;
- a row to ``docs/how-to/to-the-robot.md``;
- an independent reader to ``tests/robot_readers.py``, and its cases to ``tests/digitise/robots/``.
  ``tests/sealtwin/trial/test_robot.py`` writes every format.
"""
