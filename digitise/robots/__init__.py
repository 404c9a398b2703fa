"""Programs for robots: a cell, the path in the robot's frame, and a template for each language.

To add a language, add

- a file such as ``digitise/robots/spel.py``: its settings, the template of its program, the function that checks its
  limits and fills the template, and its ``Language``;
- that ``Language`` to ``LANGUAGES`` in ``digitise/robots/cell.py``, which cell files, --format, plans and reports read;
- an example of its table to ``sealtwin/templates/starter_cell.toml``, and a row to ``docs/how-to/to-the-robot.md``;
- an independent reader to ``tests/support/robot_readers.py``, its table to ``tests/support/robot_cells.py``, and its
  cases to ``tests/digitise/robots/``. ``tests/sealtwin/trial/test_robot.py`` writes every format.
"""
