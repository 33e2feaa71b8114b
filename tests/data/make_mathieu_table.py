"""Makes mathieu_growth.npz: 30-digit growth rates of damped Mathieu's equation at random points of the
1000 x 1000 grid of the headline chart.

    q'' + 2 delta q' + (a + b cos t) q = 0,  T = 2 pi;  x'' + (a - delta^2 + b cos t) x = 0 for q = exp(-delta t) x

The witness is a Taylor series in integer arithmetic (fixed point, 2^-200), unrelated to the library's Magnus steps
and Chebyshev tensors: with x = sum x_k s^k about the time t0 of a step of length h,

    (k + 2)(k + 1) x_{k+2} = -(a - delta^2) x_k - b sum_j c_j x_{k-j},   cos(t0 + s) = sum c_j s^j,

16 steps over half a period for the two fundamental solutions u1, u2 (even and odd about t = 0), then
tr = 2 (u1 u2' + u1' u2) by the symmetry about t = 0 and t = pi. Checked against mpmath.odefun at three points.

    python tests/data/make_mathieu_table.py
"""

from __future__ import annotations

from pathlib import Path

import mpmath
import numpy as np

WINDOW = (-1.0, 5.0, 0.0, 5.0)
DELTAS = (0.0, 0.05, 0.3)
POINTS, GRID = 1200, 1000
STEPS, TERMS, BITS = 16, 60, 220
ONE = 1 << BITS


def trace(a: float, b: float, delta: float) -> mpmath.mpf:
    """Trace of the undamped monodromy matrix, as an mpf with about 50 digits."""
    mpmath.mp.prec = BITS + 40
    exact = [int(mpmath.floor(mpmath.mpf(v) * ONE)) for v in (mpmath.mpf(a) - mpmath.mpf(delta) ** 2, mpmath.mpf(b))]
    stiffness, depth = exact
    h = mpmath.pi / STEPS
    H = int(h * ONE)
    solutions = [[ONE, 0], [0, ONE]]
    for step in range(STEPS):
        t0 = h * step
        c, s = mpmath.cos(t0), mpmath.sin(t0)
        wave = []
        factorial = mpmath.mpf(1)
        for j in range(TERMS):
            factorial *= max(j, 1)
            wave.append(int((c, -s, -c, s)[j % 4] / factorial * ONE))
        for solution in solutions:
            x = [solution[0], solution[1]]
            for k in range(TERMS - 2):
                convolution = sum(wave[j] * x[k - j] for j in range(k + 1)) >> BITS
                value = (stiffness * x[k] + depth * convolution) >> BITS
                x.append(-value // ((k + 1) * (k + 2)))
            position, velocity = 0, 0
            for k in range(TERMS - 1, -1, -1):
                position = ((position * H) >> BITS) + x[k]
                if k:
                    velocity = ((velocity * H) >> BITS) + k * x[k]
            solution[0], solution[1] = position, velocity
    (u1, v1), (u2, v2) = [[mpmath.mpf(p) / ONE for p in s] for s in solutions]
    assert abs(u1 * v2 - u2 * v1 - 1) < mpmath.mpf(10) ** -45
    return 2 * (u1 * v2 + v1 * u2)


def growth(tr: mpmath.mpf, delta: float) -> mpmath.mpf:
    """Largest real Floquet exponent."""
    size = abs(tr) / 2
    return (mpmath.acosh(size) if size > 1 else mpmath.mpf(0)) / (2 * mpmath.pi) - mpmath.mpf(delta)


def check() -> None:
    """Three points against mpmath's own Taylor solver."""
    for a, b, delta in ((0.3, 1.1, 0.0), (2.0, 4.0, 0.3), (-0.9, 3.0, 0.05)):
        ours = trace(a, b, delta)
        mpmath.mp.dps = 25
        k = mpmath.mpf(a) - mpmath.mpf(delta) ** 2
        total = mpmath.mpf(0)
        for start in ((1, 0), (0, 1)):
            f = mpmath.odefun(
                lambda t, y, k=k, b=b: [y[1], -(k + mpmath.mpf(b) * mpmath.cos(t)) * y[0]], 0, list(start)
            )
            total += f(2 * mpmath.pi)[start.index(1)]
        assert abs(total - ours) < mpmath.mpf(10) ** -18 * max(1, abs(ours)), (a, b, delta, total, ours)


def main() -> None:
    check()
    random = np.random.default_rng(2024)
    x0, x1, y0, y1 = WINDOW
    column, row = random.integers(0, GRID, POINTS), random.integers(0, GRID, POINTS)
    a, b = np.linspace(x0, x1, GRID)[column], np.linspace(y0, y1, GRID)[row]
    delta = random.choice(DELTAS, POINTS)
    rows = []
    for values in zip(a.tolist(), b.tolist(), delta.tolist(), strict=True):
        tr = trace(*values)
        g = growth(tr, values[2])
        high = float(g)
        rows.append((high, float(g - high), float(tr)))
    table = np.array(rows)
    np.savez(
        Path(__file__).with_name("mathieu_growth.npz"),
        column=column, row=row, a=a, b=b, delta=delta, growth=table[:, 0], growth_low=table[:, 1], trace=table[:, 2], window=np.array(WINDOW),
    )  # fmt: skip


if __name__ == "__main__":
    main()
