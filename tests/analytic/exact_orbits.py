"""Truth for the perturbation methods, by scipy's DOP853 alone: shooting for periodic orbits, Floquet matrices, orders.

Nothing here uses the library: a periodic orbit is a zero of the period map (Newton, difference Jacobian), its
fundamental amplitude comes from 256 samples over the period of the harmonic, accurate to rounding for smooth motion.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

SMALL = (0.2, 0.1, 0.05, 0.025)
TIGHT = dict(method="DOP853", rtol=1e-12, atol=1e-13)


def observed_orders(errors, small=SMALL):
    """Exponents p of error ~ eps^p between neighbours."""
    errors, small = np.asarray(errors, float), np.asarray(small, float)
    return np.diff(np.log(errors)) / np.diff(np.log(small))


def assert_order(errors, stated, slack=0.12, small=SMALL):
    """The exponent between the two smallest eps is the stated one."""
    orders = observed_orders(errors, small)
    assert abs(orders[-1] - stated) < slack, f"errors {errors}, orders {orders}, stated {stated}"


def amplitudes(samples):
    """(mean, amplitude of the fundamental harmonic) of one period."""
    c = np.fft.rfft(samples) / len(samples)
    return c[0].real, 2 * abs(c[1])


def free_orbit(acceleration, start):
    """(omega, mean, fundamental amplitude) of q'' = acceleration(q) from rest at q = start > 0, one full period."""

    def turning(t, y):
        return y[1]

    turning.direction = -1  # v falls through zero: a maximum, the next one is a period later

    def f(t, y):
        return [y[1], acceleration(y[0])]

    first = solve_ivp(f, (0, 60), [start, 0.0], events=turning, max_step=0.5, **TIGHT)
    times = [s for s in first.t_events[0] if s > 1e-3]
    period = times[0]
    n = 256
    samples = solve_ivp(f, (0, period), [start, 0.0], t_eval=period * np.arange(n) / n, **TIGHT).y[0]
    mean, a = amplitudes(samples)
    return 2 * np.pi / period, mean, a


def periodic_orbit(f, period, guess, *, samples=256):
    """(state at 0, samples (n, 256) over the period) of a periodic orbit of x' = f(t, x)."""
    x = np.array(guess, float)
    n = len(x)

    def mapped(y):
        return solve_ivp(f, (0, period), y, **TIGHT).y[:, -1]

    scale = 1e-6 * max(1.0, np.abs(x).max())
    for _ in range(12):
        r = mapped(x) - x
        J = np.array([(mapped(x + scale * e) - mapped(x - scale * e)) / (2 * scale) for e in np.eye(n)]).T
        step = np.linalg.solve(J - np.eye(n), -r)
        x = x + step
        if np.abs(step).max() < 1e-10 * (1 + np.abs(x).max()):
            break
    else:
        raise AssertionError("shooting did not converge")
    return x, solve_ivp(f, (0, period), x, t_eval=period * np.arange(samples) / samples, **TIGHT).y


def orbit_with_amplitude(field, amplitude, state, frequency):
    """Frequency at which x' = field(t, x, w), 2 pi/w periodic, answers with a fundamental amplitude; Newton in (x, w)."""
    z = np.array([*state, frequency])
    n = 128

    def residual(y):
        period = 2 * np.pi / y[-1]
        times = np.append(period * np.arange(n) / n, period)
        rows = solve_ivp(lambda t, x: field(t, x, y[-1]), (0, period), y[:-1], t_eval=times, **TIGHT).y
        return np.append(rows[:, -1] - y[:-1], amplitudes(rows[0, :-1])[1] - amplitude)

    for _ in range(12):
        r = residual(z)
        J = np.array([(residual(z + 1e-6 * e) - residual(z - 1e-6 * e)) / 2e-6 for e in np.eye(len(z))]).T
        step = np.linalg.solve(J, -r)
        z = z + step
        if np.abs(step).max() < 1e-10:
            return z[-1]
    raise AssertionError("no convergence")


def floquet_matrix(stiffness, damping, period):
    """Fundamental matrix of y'' + 2 damping y' + stiffness(t) y = 0 over a period."""

    def f(t, y):
        return [y[1], -2 * damping * y[1] - stiffness(t) * y[0], y[3], -2 * damping * y[3] - stiffness(t) * y[2]]

    end = solve_ivp(f, (0, period), [1.0, 0.0, 0.0, 1.0], **TIGHT).y[:, -1]
    return np.array([[end[0], end[2]], [end[1], end[3]]])
