"""The foundation that all stages share: records, settings, errors, progress, files and the run folder."""
