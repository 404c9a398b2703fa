"""Programs for robots: a cell, the path in the robot's frame, and a table of languages (``programs``)."""
