"""Figures of runs, of trials and of studies, one function each.

``theme`` has the colours, sizes and helpers of all figures; ``particles`` draws sealant. ``snapshots`` and ``film``
show a run; ``levels``, ``solid_pictures`` and ``turntable`` a trial. ``chart`` and ``side_by_side`` compare runs, the
modules ``..._sheet`` make pages of them, and ``figure_sheet`` writes a page.
``drawing`` writes a figure as SVG or pixels.
"""
