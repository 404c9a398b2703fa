"""Figures of runs, trials and studies, one function each, and the pages of studies.

``theme`` defines colours, sizes and the elements that figures share: axes with the line of the face, a level with its
band, the sample's material. ``particles`` draws the sealant in a sample along the crack, from above and across.
``drawing`` writes a figure as SVG or pixels.

To add a figure to the report, write a function in ``levels`` that returns a ``Figure``. Then list it as a ``Plate``
with its caption in ``validate.report.chapters``, which puts it on the page and into the PDF. ``Comparison.stations``
contains the stations that both levels cover, with both levels. The report of a finished run is drawn again only if its
report.html is deleted, or if ``REPORT_FORM`` in ``sealtwin.trial.validate_stage`` is raised.

To add a figure to the page of a study, write the function. Then list it as a ``Plot``, with its caption and the numbers
for its CSV, in the function of that page: ``map_page``, ``calibration_page``, or the plan's page
(``sealtwin.plan.verify``). ``page`` writes all pages.
"""
