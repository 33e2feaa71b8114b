r"""Lines of a nearly periodic signal, to far better than one over its length: numerical analysis of frequencies.

The windowed Fourier integral of samples x_j = x(j dt) over the record T = N dt,

    A(f) = 1/N sum_j w(t_j) x_j exp(-2 pi i f t_j),     w = 2^p (p!)^2/(2p)! (1 - cos(2 pi t/T))^p,

has the maximum of its modulus at a line's frequency up to what other lines leak there, which falls like 1/(T |f -
f'|)^(2p+1). Lines are found one after the other, strongest first, in what the others leave; then all frequencies are
improved with the other lines taken away, and all amplitudes fitted together by weighted least squares.

References: J. Laskar (1993), Physica D 67, 257-281; (1999), in Hamiltonian Systems with Three or More Degrees of
Freedom, 134-150 (the windows and their errors).
"""

from __future__ import annotations

import math

import numpy as np

__all__ = ["fitted", "lines", "window"]

Array = np.ndarray
_ROUNDS = 8
_FEW = 8  # so many lines are improved together whenever one is added
_NOTHING = 1e-13
_SETTLED = 1e-9  # of the spacing 1/T: Newton's last step is squared


def window(count: int, power: int) -> Array:
    """(N,) the Hann window of this power, mean 1."""
    t = np.arange(count) / count
    height = 2.0**power * math.factorial(power) ** 2 / math.factorial(2 * power)
    return np.asarray(height * (1 - np.cos(2 * np.pi * t)) ** power)


def lines(
    values: Array, dt: float, most: int, power: int = 3, floor: float = 1e-9, start: Array | None = None
) -> Array:
    """(K,) frequencies in cycles per unit time, strongest first, K <= most; those above `floor` of the largest.

    start : frequencies to begin with (they are improved, and others added)
    """
    count = len(values)
    w = window(count, power)
    x = values - w @ values / count
    found = np.zeros(0) if start is None else np.array(start, float)
    spacing = 1.0 / (count * dt)
    rest = x - _model(x, w, found, dt)
    largest = float(np.abs(np.fft.rfft(w * x)).max(initial=0.0))
    if not largest > _NOTHING * count * float(np.abs(values).max(initial=0.0)):
        return np.zeros(0)
    while len(found) < most:
        spectrum = np.abs(np.fft.rfft(w * rest, 2 * count))
        spectrum[: 2 * power] = 0.0
        k = int(np.argmax(spectrum))
        if not spectrum[k] > floor * largest:
            break
        new = _peak(w * rest, dt, 0.5 * k * spacing, 0.5 * spacing)
        if len(found) and np.abs(found - new).min() < spacing:
            break  # the rest of a line that is no line: a drift or chaos broadens it
        found = _improved(x, w, np.append(found, new), dt, 2 if len(found) < _FEW else 0)
        rest = x - _model(x, w, found, dt)
    return _improved(x, w, found, dt, _ROUNDS)


def _improved(x: Array, w: Array, found: Array, dt: float, rounds: int) -> Array:
    """The frequencies, each with the other lines taken away, over and over."""
    spacing = 1.0 / (len(x) * dt)
    for _ in range(rounds if len(found) > 1 else 0):
        before, design = found.copy(), _design(len(x), found, dt)
        c = _coefficients(x, w, design)
        rest, k = x - design @ c, len(found)
        for i in range(k):
            own = c[1 + i] * design[:, 1 + i] + c[1 + k + i] * design[:, 1 + k + i]
            found[i] = _peak(w * (rest + own), dt, before[i], 0.2 * spacing)
        if np.abs(found - before).max() <= _SETTLED * spacing:
            break
    return found


def _design(count: int, frequencies: Array, dt: float) -> Array:
    """(N, 1 + 2 K): constant, cosines, sines."""
    phase = 2 * np.pi * np.outer(np.arange(count) * dt, frequencies)
    return np.column_stack([np.ones(count), np.cos(phase), np.sin(phase)])


def _coefficients(x: Array, w: Array, design: Array) -> Array:
    weighted = design * w[:, None]
    return np.asarray(np.linalg.lstsq(weighted.T @ design, weighted.T @ x, rcond=1e-13)[0])


def _model(x: Array, w: Array, frequencies: Array, dt: float) -> Array:
    design = _design(len(x), frequencies, dt)
    return np.asarray(design @ _coefficients(x, w, design))


def fitted(values: Array, dt: float, frequencies: Array, power: int = 3) -> tuple[float, Array, float]:
    """(mean, complex amplitudes (K,), relative rms of the rest): x = mean + sum Re c_k exp(2 pi i f_k t)."""
    w = window(len(values), power)
    design = _design(len(values), frequencies, dt)
    c = _coefficients(values, w, design)
    rest = values - design @ c
    k = len(frequencies)
    swing = values - c[0]
    left = math.sqrt(float(w @ rest**2)) / (math.sqrt(float(w @ swing**2)) or 1.0)
    return float(c[0]), c[1 : 1 + k] - 1j * c[1 + k :], left


def _peak(weighted: Array, dt: float, guess: float, reach: float) -> float:
    """The frequency of the largest |A| near the guess: Newton's method on d|A|^2/df = 0, kept within the reach."""
    t = dt * np.arange(len(weighted))
    t = t - t.mean()  # the phase then turns slowly with f
    f = guess
    for _ in range(8):
        wave = weighted * np.exp(-2j * np.pi * f * t)
        a, b, c = wave.sum(), (wave * t).sum(), (wave * t * t).sum()
        # A' = -2 pi i b, A'' = -4 pi^2 c;  (|A|^2)' = 2 Re(A* A'), (|A|^2)'' = 2 |A'|^2 + 2 Re(A* A'')
        first = 4 * np.pi * float((a.conjugate() * b).imag)
        second = 8 * np.pi**2 * (abs(b) ** 2 - float((a.conjugate() * c).real))
        step = -first / second if second < 0 else math.copysign(0.25 * reach, first)
        step = max(-reach, min(reach, step))
        f += step
        if abs(step) <= _SETTLED * reach:
            break
    return f if abs(f - guess) <= 4 * reach else guess
