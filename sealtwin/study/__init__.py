"""Studies: a trial that is computed many times with other settings, and comparisons of runs."""
