"""Figure 8: instability regions of the five parametric systems and of the circuit with R(t), in physical axes.

1 pendulum with driven pivot, 2 pendulum of varying length, 3 mass on a string of varying tension, 4 circuit with C(t),
5 circuit with L(t), 6 circuit with R(t). All lightly damped, so that each tongue opens at a depth of its own. Checked
against averaging near the principal tongue: with the stiffness modulated by depth b about w0^2 and the damping delta,
the tongue opens at b = 4 delta w0 (relative error O(depth)); R(t) never grows while it is positive (energy).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st

SHAPE = (500, 400)
W0 = 1 / math.sqrt(1e-3 * 1e-6)  # the circuits' natural frequency, rad/s


def compute() -> dict[str, Any]:
    """One chart for each system."""
    models = st.models
    pendulum = models.base_driven_pendulum.from_physical(length=0.1081, damping=2e-5)
    string = models.modulated_string(damping=0.03)
    circuit = dict(resistance=1.0)
    x = ("omega", 0.5 * W0, 2.6 * W0)
    return {
        "1  driven pivot": st.chart(pendulum, x=("frequency", 1.0, 5.0), y=("amplitude", 0.0, 0.1), shape=SHAPE),
        "2  varying length": st.chart(
            models.variable_length_pendulum(damping=0.05), x=("omega", 2.0, 8.0), y=("epsilon", 0.0, 0.5), shape=SHAPE
        ),
        "3  varying tension": st.chart(string, x=("omega", 25.0, 160.0), y=("epsilon", 0.0, 0.9), shape=SHAPE),
        "4  C(t)": st.chart(models.capacitance_modulated_circuit(**circuit), x=x, y=("epsilon", 0.0, 0.7), shape=SHAPE),
        "5  L(t)": st.chart(models.inductance_modulated_circuit(**circuit), x=x, y=("epsilon", 0.0, 0.7), shape=SHAPE),
        "6  R(t)": st.chart(
            models.resistance_modulated_circuit(resistance=5.0), x=x, y=("epsilon", 0.0, 12.0), shape=SHAPE
        ),
    }


def check(data: dict[str, Any]) -> None:
    """Thresholds of the principal tongues by averaging; no growth under positive resistance."""
    w2 = math.sqrt(9.81 / 0.1081)
    # name -> (natural frequency, damping constant, modulation depth b of the stiffness per unit of y at 2 w0)
    expected = {
        "1  driven pivot": (w2, 2e-5 / (2 * 0.01 * 0.1081**2), (2 * w2) ** 2 / 0.1081),
        "3  varying tension": (math.sqrt(4000.0), 0.03 / 0.02, 4000.0),
        "4  C(t)": (W0, 500.0, W0**2),
    }
    for name, (w0, delta, per_unit) in expected.items():
        tip = min(data[name].tips, key=lambda tip: tip.order)
        assert tip.order == 1 and tip.kind == "-1", name
        assert abs(tip.y * per_unit / (4 * delta * w0) - 1) < 0.02, (name, tip.y)
        frequency = 2 * w0 / (2 * math.pi) if name.startswith("1") else 2 * w0
        assert abs(tip.x / frequency - 1) < 0.01, (name, tip.x)
    positive = data["6  R(t)"].y <= 1.0
    assert (data["6  R(t)"].growth_rate[positive] <= 1e-6 * W0).all()
    assert (data["6  R(t)"].growth_rate > 0).any()
    assert all(chart.error <= 1e-10 * max(1.0, np.abs(chart.growth_rate).max()) for chart in data.values())


def draw(data: dict[str, Any], path: Path) -> None:
    """Six panels."""
    figure, axes = _figure.panels(3, 2, width=10.0, height=6.0)
    for axis, (name, chart) in zip(axes.flat, data.items(), strict=True):
        chart.plot(ax=axis)
        _figure.letter(axis, name)
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
