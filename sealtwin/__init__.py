"""The face of the toolkit: command line, trial file, run folder, and the records that stages exchange."""
