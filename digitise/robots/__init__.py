"""Write programs for robots from a cell file and a nozzle path. Each language has a template.

To add a language:

- Add a file such as ``digitise/robots/spel.py``. It has the settings, the template of the program, the function that
  checks limits and fills the template, and the ``Language``.
- Add that ``Language`` to ``LANGUAGES`` in ``digitise/robots/cell.py``. Cell files, --format, plans and reports
  read it.
- Add an example of its table to ``sealtwin/templates/starter_cell.toml``, and a row to
  ``docs/how-to/to-the-robot.md``.
- Add an independent reader to ``tests/support/robot_readers.py``, its table to ``tests/support/robot_cells.py``, and
  its cases to ``tests/digitise/robots/``. ``tests/sealtwin/trial/test_robot.py`` writes every format.
"""
