"""Digitising: a top-down photo and a depth become a crack solid and a nozzle trajectory."""

PART_OF = "sealtwin"

TRACING_NUMBER = 3
"""Increased by one whenever the same photo, drawing or mesh gives different walls. A change that moves no bit leaves
it."""

SOLIDS_NUMBER = 2
"""Increased by one whenever the same walls and settings give a different solid or nozzle path.

Benchmark results for drawn walls depend on this number, and not on ``TRACING_NUMBER``."""

STAGE_NUMBER = TRACING_NUMBER + SOLIDS_NUMBER
"""Results that were computed under another number are computed again.

``python -m tests.stage_record`` remakes the record against which a test checks both numbers."""
