"""A report's chapters, and their three forms: a page, a PDF, a file for programs."""
