"""A second reality: a continuum pour of a Bingham or Herschel-Bulkley paste between two walls.

It shares no code and no numerics with sealtwin's particles or its slot model, and its author had read neither: so a
prediction that was told before can be judged by it. The section of the slot is solved by finite elements, once, and
kept as tables (``law``); along the slot volumes are conserved (``along``); the surface across is in ``surface``.

FROZEN. It was checked by closed forms, limits and orders of convergence before any band was judged in it: 33 of 34
targets, the last of which ``benchmarks/second_reality.py`` of release 1.0.0rc1 has with its reason. Some of them are
tests (``tests/benchmarks/test_second_reality.py``). It is not to be changed to suit a judgement: a fault that is mended
here voids all judgements that were made in it. Loops over cells became NumPy's operations later: 28 pours, a pair of
each world among them, came out the same to 1e-12 mm.

Not in it: inertia and the jet's fall, paste that does not reach the walls, layers of different age in one section,
flow along the face beside the mouth, a slot that leans or bends, surface tension during the flow.
"""
