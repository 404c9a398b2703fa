"""Digitise a crack: a top-down photo and a depth become a solid of the crack and a nozzle trajectory."""

PART_OF = "sealtwin"

TRACING_NUMBER = 3
"""Version of the tracing code. Increase it by one whenever the same photo, drawing or mesh gives different walls."""

SOLIDS_NUMBER = 3
"""Version of the solid and trajectory code. Increase it if the same walls and settings give another solid or path.

Benchmark results for drawn walls depend on this number, and not on ``TRACING_NUMBER``."""

STAGE_NUMBER = TRACING_NUMBER + SOLIDS_NUMBER
"""Version of the whole stage. Results that were computed under another number are computed again.

``python -m tests.stage_record`` updates the record against which a test checks both numbers."""
