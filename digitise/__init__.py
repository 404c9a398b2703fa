"""Digitising: a top-down photo and a depth become a crack solid and a nozzle trajectory."""

PART_OF = "sealtwin"

TRACING_NUMBER = 1
"""Raised by one whenever the same photo, drawing or mesh gives other walls; what moves no bit leaves it."""

SOLIDS_NUMBER = 1
"""Raised by one whenever the same walls and settings give another solid or nozzle path.

Results of walls that a benchmark draws depend on this number, and not on ``TRACING_NUMBER``.
"""

STAGE_NUMBER = TRACING_NUMBER + SOLIDS_NUMBER
"""Runs of another number are computed anew.

``python -m tests.stage_record`` remakes the record that a test holds both numbers to.
"""
