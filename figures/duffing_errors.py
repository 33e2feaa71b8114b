"""Error of each method against the small parameter: Duffing's response near its primary resonance.

x'' + 2 xi x' + x + beta x^3 = F cos(Omega tau), xi = 0.1 eps, beta = eps, F = 1.5 eps, Omega = 1 + 0.6 eps: what is
shown is the relative error of the fundamental amplitude against harmonic balance with 31 harmonics. The order of a
method is the slope: multiple scales and averaging 1, their second orders 2, harmonic balance with 1, 3, 5 harmonics
1, 3, 5: the first harmonic that is left out, O(eps^((H+1)/2)), acts on the fundamental through one that is as small.

Checked: the slopes, averaging equal to one-term harmonic balance, each order closer than the one before at all eps.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.errors import TruncationWarning
from stability.plots import style

EPS = np.array([0.4, 0.2, 0.1, 0.05, 0.025, 0.0125])
ORDERS = {"multiple scales": 1, "averaging": 1, "multiple scales, order 2": 2, "averaging, order 2": 2,
          "3 harmonics": 3, "5 harmonics": 5}  # fmt: skip
FLOOR = 3e-14  # rounding


def problems(system: st.System) -> dict[str, Any]:
    """A problem by method."""
    found: dict[str, Any] = {}
    for label, verb in (("multiple scales", st.multiple_scales), ("averaging", st.averaging)):
        for order in (1, 2):
            found[label + ("" if order == 1 else ", order 2")] = st.Equilibrium(verb(system, order=order))
    for harmonics in (1, 3, 5):
        found[f"{harmonics} harmonic{'s' * (harmonics > 1)}"] = st.HarmonicBalance(system, harmonics=harmonics)
    return found


def amplitude(problem: Any, system: st.System, orbit: Any) -> float:
    """Fundamental amplitude of the solution next to an orbit."""
    if isinstance(problem, st.Equilibrium):
        c = np.fft.rfft(orbit(np.arange(64) / 64 * orbit.period)[0])[1] / 32  # x = Re(c e^{i Omega t})
        point = st.solve(problem, start=np.array([c.real, -c.imag]), tolerance=1e-13)
        return float(np.hypot(*point.x))
    p = system.parameter_vector()
    found = problem.correct(problem.start(p, orbit), p, "omega", None, 0.0, 1e-13)
    assert found.converged
    return float(problem.measures(found.u, p)["x.amplitude(1)"])


def compute() -> dict[str, Any]:
    """Errors, (method, eps)."""
    errors: dict[str, list[float]] = {}
    for eps in EPS.tolist():
        system = st.models.duffing_textbook(delta=0.2 * eps, alpha=1.0, beta=eps, gamma=1.5 * eps, omega=1 + 0.6 * eps)
        start = st.solve(st.Equilibrium(st.averaging(system)))
        exact = st.HarmonicBalance(system, harmonics=31)
        times = system.period * np.arange(256) / 256
        p = system.parameter_vector()
        guess = exact.discretise(times, st.reconstruct(st.averaging(system), start, times), system.period)
        found = exact.correct(guess, p, "omega", None, 0.0, 1e-13)
        truth, orbit = exact.measures(found.u, p)["x.amplitude(1)"], exact.view(found.u, p)
        with warnings.catch_warnings():  # few harmonics on purpose
            warnings.simplefilter("ignore", TruncationWarning)
            for name, problem in problems(system).items():
                errors.setdefault(name, []).append(abs(amplitude(problem, system, orbit) / truth - 1))
    return {"errors": {name: np.array(values) for name, values in errors.items()}}


def slope(errors: np.ndarray) -> float:
    """Between the two smallest eps whose errors are above rounding."""
    last = max(1, int(np.nonzero(errors > 30 * FLOOR)[0][-1]))
    return float(np.log(errors[last - 1] / errors[last]) / np.log(EPS[last - 1] / EPS[last]))


def check(data: dict[str, Any]) -> None:
    """Slopes, and which method is closer."""
    errors = data["errors"]
    data["slopes"] = {name: slope(values) for name, values in errors.items()}
    for name, order in ORDERS.items():
        assert abs(data["slopes"][name] - order) < 0.1 * order, (name, data["slopes"][name])
    assert np.allclose(errors["averaging"], errors["1 harmonic"], rtol=1e-8, atol=1e-13)
    for better, worse in (("averaging, order 2", "averaging"), ("3 harmonics", "averaging, order 2"),
                          ("5 harmonics", "3 harmonics")):  # fmt: skip
        assert (errors[better] < errors[worse]).all()


def draw(data: dict[str, Any], path: Path) -> None:
    """Log-log, with the slope in the legend."""
    figure, axes = _figure.panels(1, width=7.4, height=3.6)
    markers = "os^vDP"
    colours = [c for c in style.SERIES if c != style.COLOURS["black"]]
    for k, name in enumerate(ORDERS):
        values = data["errors"][name]
        shown = values > FLOOR
        label = f"{name}" + (" = 1 harmonic" if name == "averaging" else "") + f": slope {data['slopes'][name]:.2f}"
        axes.loglog(EPS[shown], values[shown], marker=markers[k], color=colours[k % len(colours)], markersize=4.5,
                    linestyle="-" if "scales" not in name else "--", label=label)  # fmt: skip
    axes.set(xlabel=r"small parameter $\varepsilon$", ylabel="relative error of the amplitude")
    axes.set_xticks(EPS, [f"{e:g}" for e in EPS])
    axes.minorticks_off()
    axes.legend(fontsize="small", frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
