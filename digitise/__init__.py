"""Digitising: a top-down photo and a depth become a crack solid and a nozzle trajectory."""

PART_OF = "sealtwin"

STAGE_NUMBER = 1
"""Raised by one whenever the same input gives another number in the results of this stage; what moves no bit leaves it.

Runs of another number are computed anew. ``python -m tests.stage_record`` remakes the record that a test holds it to.
"""
