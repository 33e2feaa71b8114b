"""The spring-mass-pendulum with the pendulum at rest and swinging: angle and primary motion over the frequency.

u'' + 2 xi1 u' + u + lm ll (th'^2 cos th + th'' sin th) = Omega^2 cos(Omega tau),
th'' + 2 xi2 Omega0 th' + sin th (Omega0^2 + (u'' - Omega^2 cos(Omega tau))/ll) = 0,   xi1 = 0.002, xi2 = 0.005,
lm = 0.2, ll = 1000, Omega0 = 0.48. At rest (theta = 0) the primary is a linear oscillator; between two period
doublings that rest is unstable. The branch that is born there has orbits of twice the period; its upper part is stable
but for a stretch between two Neimark-Sacker points, where the motion is a torus.

Checked: the doublings against the exact damped Mathieu problem of the pendulum (no time stepping) to 1e-9; one
multiplier -1 there, a pair of modulus 1 at the torus points; theta(t + T/2) = -theta(t) on the branch.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import _figure
import numpy as np
from scipy.optimize import brentq

import stability as st
from stability.plots import style

WINDOW = (0.88, 1.1)
FINE = dict(ds_max=0.05)


def compute() -> dict[str, Any]:
    """Both branches."""
    pendulum = st.models.autoparametric_pendulum()
    rest = st.continuation(st.Collocation(pendulum), "Omega", WINDOW, **FINE)
    swing = st.continuation(st.switch(rest["PD1"]), "Omega", WINDOW, **FINE)
    return {"parameters": dict(pendulum.parameters), "rest": rest, "swing": swing}


def growth(Omega: float, p: dict[str, float]) -> float:
    """Growth rate of theta about rest: the exact Mathieu exponent less the damping."""
    absolute = 1 + Omega**2 / (1 - Omega**2 + 2j * p["xi1"] * Omega)
    depth, delta = Omega**2 * abs(absolute) / p["length_ratio"], p["xi2"] * p["Omega0"]
    a, q = 4 * (p["Omega0"] ** 2 - delta**2) / Omega**2, 2 * depth / Omega**2
    return float(st.mathieu_exponent(a, q).imag * Omega / 2 - delta)


def check(data: dict[str, Any]) -> None:
    """Special points by closed form and by their multipliers."""
    rest, swing = data["rest"], data["swing"]
    assert rest.labels == ("PD1", "PD2")
    for point in rest.special:
        here = point.params["Omega"]
        exact = brentq(growth, here - 1e-4, here + 1e-4, args=(data["parameters"],), xtol=1e-14)
        assert abs(here - exact) < 1e-9 and np.abs(point.multipliers + 1).min() < 1e-8
    torus = swing.of_kind(st.Kind.NEIMARK_SACKER)
    assert len(torus) == 2 and swing.status is st.Status.CLOSED_LOOP
    for point in torus:
        pair = [m for m in point.multipliers if m.imag > 1e-3]
        assert min(abs(abs(m) - 1) for m in pair) < 1e-7
        orbit = point.solution
        times = np.linspace(0, orbit.period / 2, 9)
        assert np.allclose(orbit(times + orbit.period / 2)[1], -orbit(times)[1], atol=1e-7)
    between = sum(p.params["Omega"] for p in torus) / 2
    assert st.Verdict.STABLE not in {o.verdict for o in (*swing.at(Omega=between), *rest.at(Omega=between))}


def draw(data: dict[str, Any], path: Path) -> None:
    """Angle and primary motion."""
    figure, axes = _figure.panels(2, width=7.6, height=3.6)
    inner = (st.Kind.FOLD, st.Kind.NEIMARK_SACKER)
    for axis, column, letter in zip(axes, ("theta.max", "u.max"), "ab", strict=True):
        data["rest"].plot(ax=axis, y=column, label="pendulum at rest")
        data["swing"].plot(ax=axis, y=column, color=style.SERIES[2], kinds=inner, label="pendulum swings")
        _figure.letter(axis, f"({letter})")
    axes[0].set(ylabel=r"max $\theta$ (rad)", ylim=(-0.03, 0.6))
    axes[0].legend(fontsize="small", frameon=False, loc="upper left", ncols=2)
    axes[1].set_yscale("log")
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
