"""Figures of runs, of trials and of studies, one function each.

``theme`` has the colours, sizes and helpers of all; ``particles`` draws sealant. ``snapshots`` and ``film`` show a run,
``levels``, ``solid_pictures`` and ``turntable`` a trial; ``chart`` and ``side_by_side`` compare the runs of which the
modules ``..._sheet`` are the pages, written by ``figure_sheet``.
"""
