"""The report: page, PDF and report.json from the same facts."""
