"""Programs for robots: one module per language, each a function from a ``RobotPath`` to text.

A new language takes its module here, its name, table and checks in ``cell.py`` (``Format``, a class of settings, its
field and ``missing_for`` in ``RobotCell``), its file's name and writer in ``PROGRAMS`` of
``sealtwin/trial/robot_files.py``, a table in ``sealtwin/templates/starter_cell.toml``, the help of ``--format`` in
``sealtwin/cli/trials.py``, a row in ``docs/how-to/to-the-robot.md``, and an independent reader in
``tests/robot_readers.py`` with its cases in ``tests/digitise/robots/``; ``tests/sealtwin/trial/test_robot.py`` writes
every format. A language whose dispenser limits the flow, the speed or the start has these limits in
``RobotCell.steady_settings``, ``plan.shape.limits_of`` and ``robot_path.place_path`` as well.
"""
