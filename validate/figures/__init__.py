"""Figures of runs, of trials and of studies, one function each, and the pages of studies.

``theme`` has the colours, the sizes and the parts that figures share: axes with the line of the face, a level with its
band, the ground. ``particles`` has the views of sealant in a sample: along the crack, from above, across. ``drawing``
writes a figure as SVG or pixels.

To add a figure to the report, write a function that returns a ``Figure``, beside those in ``levels``, and list it as a
``Plate`` with its caption in ``validate.report.chapters``: page and PDF then have it. The stations that both levels
cover, with both levels, are ``Comparison.stations``. The report of a finished run is drawn anew only if its report.html
is deleted, or if ``REPORT_FORM`` in ``sealtwin.trial.validate_stage`` is raised.

To add a figure to the page of a study, write the function, and list it as a ``Plot`` with its caption and the numbers
of its CSV in the function of that page: ``map_page``, ``compare_page``, ``calibration_page``, or the plan's
(``sealtwin.plan.verify``). ``page`` writes all of them.
"""
