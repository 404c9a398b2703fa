"""The command line. Each group of commands has its own file."""

import os

# Matrices here are small: further threads wait for each other, which takes 0.5 s of processor time in a run.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
