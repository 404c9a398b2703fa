"""Device code: Eqs 1 to 4 of the paper in ``pressure``, and Eq. 5 in ``viscosity``.

Their sums over neighbours are in ``pair_sums`` for any device, and in ``pair_sums_cpu`` for CPUs, which process eight
or sixteen neighbours at a time. The modules with the same names in ``simulate.fluid`` launch these kernels.
"""

# Imported so that all kernels of a run are in their module before the first launch.
from simulate.kernels import pair_kernels as pair_kernels
