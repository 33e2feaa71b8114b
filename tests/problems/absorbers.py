"""An oscillator with a small mass on a cubic spring (nonlinear energy sink), and what one harmonic says of it exactly.

x'' + eps l1 x' + x + eps (l2 r' + kappa r^3) = eps F cos(Omega t),  y'' = l2 r' + kappa r^3,  r = x - y. With
r = Re R exp(i Omega t): |A + B z|^2 z = (eps F)^2, z = |R|^2, D = 1 - Omega^2 + i Omega eps l1,
A = D + i Omega l2 (eps - D/Omega^2), B = 3/4 kappa (eps - D/Omega^2).
"""

import numpy as np
import sympy as sp

import stability as st

EPSILON, L1, L2, KAPPA = 0.05, 0.1, 0.1, 4 / 3


def absorber(F, Omega=1.0):
    t = sp.Symbol("t", real=True)
    x, y = (sp.Function(name)(t) for name in "xy")
    w, f = sp.symbols("Omega F", real=True)
    force = L2 * (x.diff(t) - y.diff(t)) + sp.Rational(4, 3) * (x - y) ** 3
    first = -EPSILON * L1 * x.diff(t) - x - EPSILON * force + EPSILON * f * sp.cos(w * t)
    return st.System.from_equations(
        {x.diff(t, 2): first, y.diff(t, 2): force}, coordinates=[x, y], period=2 * sp.pi / w,
        parameters={"Omega": Omega, "F": F}, name="absorber",
    )  # fmt: skip


def relative_amplitudes(Omega, F):
    """All |R| of one-harmonic balance, ascending."""
    D = 1 - Omega**2 + 1j * Omega * EPSILON * L1
    coupled = EPSILON - D / Omega**2
    A, B = D + 1j * Omega * L2 * coupled, 0.75 * KAPPA * coupled
    z = np.roots([abs(B) ** 2, 2 * (A * np.conj(B)).real, abs(A) ** 2, -((EPSILON * F) ** 2)])
    return np.sqrt(np.sort([v.real for v in z if abs(v.imag) < 1e-9 * abs(v) and v.real > 0]))
