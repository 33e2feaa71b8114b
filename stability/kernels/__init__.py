"""Arrays in, arrays out: the numerical kernels (numpy, numba). No classes of ours, no sympy."""
