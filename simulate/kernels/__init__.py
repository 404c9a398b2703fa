"""Device code: ``pressure`` holds Eqs 1 to 4 of the paper, ``viscosity`` Eq. 5.

Their sums over neighbours are in ``pair_sums`` (any device) and ``pair_sums_cpu`` (eight or sixteen neighbours at a
time). The modules of the same names in ``simulate.fluid`` launch these kernels.
"""

# All kernels of a run belong to their module before the first of them is launched.
from simulate.kernels import pair_kernels as pair_kernels
