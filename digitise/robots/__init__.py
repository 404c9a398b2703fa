"""Programs for robots: a cell, the path in the robot's frame, and a template for each language.

To add a language, add

- the template of its program, the function that checks its limits and fills it, and a row of ``PROGRAMS`` to
  ``digitise/robots/programs.py``;
- its name in ``Format``, its settings and checks to ``digitise/robots/cell.py``, with its limits of flow or speed in
  ``STEADY`` and ``plan.shape.limits_of``;
- a table to ``sealtwin/templates/starter_cell.toml``, the help of ``--format`` in ``sealtwin/cli/trials.py``, and a row
  to ``docs/how-to/to-the-robot.md``;
- an independent reader to ``tests/robot_readers.py``, and its cases to ``tests/digitise/robots/``.
  ``tests/sealtwin/trial/test_robot.py`` writes every format.
"""
