"""The command line. Each group of commands is in a file of this package."""

import os

# The matrices are small. More threads would wait for each other, which takes 0.5 s of processor time in a run.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
