"""Figure 7: the chain of two masses at 0.5 g and 25 Hz, 50 periods from rest.

Parameters: w1 = w2 = 169 rad/s, xi1 = xi2 = 0.021, mass ratio 0.5 (see figure 6), A = 0.19879 mm [given]; m1 = 20 g,
m2 = 10 g [chosen]. Checked: the base amplitude; the motion against the closed form of the linear system, particular
solution by a complex solve plus transient by the matrix exponential; the settled amplitudes against the transfer
functions of figure 6 and against the periodic orbit by harmonic balance, which (b) shows dashed: 4.1 % of the lower
mode's transient are left.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style

FREQUENCY, PERIODS = 25.0, 50


def compute() -> dict[str, Any]:
    """The motion from rest."""
    system = st.models.chain.from_physical(acceleration=0.5 * 9.81, frequency=FREQUENCY)
    motion = st.simulate(system, (0.0, PERIODS / FREQUENCY), rtol=1e-11, atol=1e-15)
    return {"system": system, "motion": motion, "orbit": st.solve(st.HarmonicBalance(system, harmonics=1))}


def closed_form(params: dict[str, float], times: np.ndarray) -> np.ndarray:
    """States (4, N) of the linear chain from rest, by eigenvalues."""
    m1, m2 = params["mass1"], params["mass2"]
    k1, k2, d1, d2 = (params[k] for k in ("stiffness1", "stiffness2", "damping1", "damping2"))
    M = np.diag([m1, m2])
    K, D = np.array([[k1 + k2, -k2], [-k2, k2]]), np.array([[d1 + d2, -d2], [-d2, d2]])
    w = 2 * np.pi * params["frequency"]
    steady = np.linalg.solve(K - w**2 * M + 1j * w * D, params["acceleration"] * np.array([m1, m2]))
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    values, vectors = np.linalg.eig(system)
    start = -np.concatenate([steady.real, (1j * w * steady).real])
    free = (vectors @ (np.exp(np.outer(values, times)) * np.linalg.solve(vectors, start.astype(complex))[:, None])).real
    forced = np.concatenate([steady, 1j * w * steady])[:, None] * np.exp(1j * w * times)
    return free + forced.real


def check(data: dict[str, Any]) -> None:
    """Base amplitude, closed form, settled amplitudes by the transfer functions."""
    motion, w = data["motion"], 2 * np.pi * FREQUENCY
    amplitude = 0.5 * 9.81 / w**2
    assert abs(amplitude - 0.19879e-3) < 5e-9
    times = np.linspace(0, PERIODS / FREQUENCY, 2001)
    wanted = closed_form(dict(motion.params), times)
    assert (np.abs(motion(times) - wanted).max(axis=1) < 1e-8 * np.abs(wanted).max(axis=1)).all()
    response = st.linear_response(st.models.chain())
    for name, unit in (("y1", "u"), ("y2", "v")):
        settled = amplitude * abs(response.frequency_response(np.array([w / 169.0]), unit)[0])
        assert abs(motion.last(1).max[name] / settled - 1) < 0.02
        assert abs(data["orbit"].max[name] / settled - 1) < 1e-9
    late = np.linspace((PERIODS - 1) / FREQUENCY, PERIODS / FREQUENCY, 201)
    off = motion(late)[:2] - data["orbit"](np.mod(late, 1 / FREQUENCY))[:2]
    assert 0.01 < (np.abs(off).max(axis=1) / [data["orbit"].max[n] for n in ("y1", "y2")]).max() < 0.05


def draw(data: dict[str, Any], path: Path) -> None:
    """Both masses over time, and the last periods."""
    figure, axes = _figure.panels(2, width=7.2, height=2.9, sharey=True, width_ratios=(2.2, 1))
    motion, last = data["motion"], data["motion"].last(4)
    looks = (("y1_mm", r"$y_1$", style.SERIES[0], "-"), ("y2_mm", r"$y_2$", style.COLOURS["vermilion"], "-"))
    for axis, part, width in ((axes[0], motion, 0.7), (axes[1], last, 1.3)):
        for name, label, color, dash in reversed(looks):
            axis.plot(part.t, part[name], dash, color=color, linewidth=width, label=label if axis is axes[0] else None)
        axis.set(xlabel="$t$ (s)", xlim=part.span, ylim=(-1.35, 1.6))
    times = np.linspace(*last.span, 801)
    values = 1e3 * data["orbit"](np.mod(times, 1 / FREQUENCY))
    for k in range(2):
        axes[1].plot(times, values[k], "--", color=style.COLOURS["sky"], linewidth=1.0,
                     label=None if k else "harmonic balance")
    axes[1].legend(frameon=False, fontsize="small", loc="upper right")
    axes[0].set_ylabel("displacement (mm)")
    axes[0].legend(frameon=False, fontsize="small", ncols=2, loc="upper right")
    _figure.letter(axes[0], "(a) 0.5 g, 25 Hz, 50 periods from rest")
    _figure.letter(axes[1], "(b) last 4 periods")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
