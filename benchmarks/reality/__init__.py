"""A second reality: a continuum pour of a Bingham or Herschel-Bulkley paste between two walls.

    from benchmarks.reality.inputs import Cavity, Paste, Pour
    from benchmarks.reality.pour import poured
    from benchmarks.reality.worlds import WORLDS

    bed = poured(cavity, paste, pour, WORLDS["W4 pump 0.4 s late"])
    bed.at(stations_mm)        # what a probe in the middle of the crack reads

It shares no code and no numerics with sealtwin's particles or its slot model, and its author had read neither: so a
prediction that was told before can be judged by it. The section of the slot is solved by finite elements, once, and
kept as tables (``law``); along the slot volumes are conserved (``along``); the surface across is in ``surface``.

FROZEN. It was checked by ``python -m benchmarks.second_reality``, closed forms and orders of convergence, before any
band was judged in it. It is not to be changed to suit a judgement: a fault that is mended here voids all judgements
that were made in it.

Not in it: inertia and the jet's fall, paste that does not reach the walls, layers of different age in one section,
flow along the face beside the mouth, a slot that leans or bends, surface tension during the flow.
"""
