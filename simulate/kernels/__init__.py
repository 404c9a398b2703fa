"""Device code: ``pressure`` holds Eqs 1 to 4 of the paper, ``viscosity`` Eq. 5.

Their sums over neighbours are in ``pair_sums`` (any device) and ``pair_sums_cpu`` (eight or sixteen neighbours at a
time). The modules of the same names in ``simulate.fluid`` launch these kernels.
"""
