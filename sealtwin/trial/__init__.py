"""One trial: the trial file, the three stages, and the files that the stages write to a run folder."""
