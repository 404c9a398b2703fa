"""Digitising: a top-down photo and a depth become a crack solid and a nozzle trajectory."""

PART_OF = "sealtwin"
