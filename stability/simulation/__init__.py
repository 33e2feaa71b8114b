"""Simulation: single motions, frequency sweeps, Poincare sections, Lyapunov exponents, basins."""
