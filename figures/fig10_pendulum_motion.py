"""Figure 10: the base-driven pendulum in its tongues 1:1 (left) and 2:1 (right): linear growth and nonlinear beats.

Undamped pendulum of 108.1 mm, w2 = 9.526 rad/s, phi(0) = 0.01 rad. Left: A = 100 mm at w = w2; right: A = 10 mm at
w = 2 w2 [chosen, see catalogue 6]. Checked: linear motion grows with the Floquet exponents 0.745666 1/s and
0.87774 1/s; the exact pendulum beats, first 1.032 rad at 6.78 s and 1.630 rad at 6.42 s; on the right 1.665 rad is
the largest over 60 s. The beats go around the periodic motions that continuation (collocation) and harmonic balance
give, 0.7025 rad and 1.1320 rad (both neutral).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import _figure
import numpy as np

import stability as st
from stability.plots import style

LENGTH = 0.1081
W2 = math.sqrt(9.81 / LENGTH)
CASES = {"1:1": (0.1, W2), "2:1": (0.01, 2 * W2)}


def compute() -> dict[str, Any]:
    """Exact and linear motion of both cases, and the Floquet exponents."""
    data: dict[str, Any] = {}
    for name, (amplitude, w) in CASES.items():
        values = dict(length=LENGTH, amplitude=amplitude, frequency=w / (2 * math.pi))
        exact = st.models.base_driven_pendulum.from_physical(**values)
        linear = st.models.base_driven_pendulum.from_physical(**values, linear=True)
        data[name] = {
            "exact": st.simulate(exact, (0.0, 60.0), x0=dict(phi=0.01), rtol=1e-12, atol=1e-14),
            "linear": st.simulate(linear, (0.0, 12.0), x0=dict(phi=0.01), rtol=1e-12, atol=1e-14),
            "exponent": st.monodromy(exact).exponents.real.max(),
            "orbits": periodic_motions(exact, w, 1 if name == "1:1" else 2),
        }
    return data


def periodic_motions(system: Any, w: float, multiple: int) -> dict[str, Any]:
    """The swinging motion of the forcing's or of twice its period, by two methods, from a sine of 1 rad."""

    def guess(t: Any) -> np.ndarray:
        s = w * np.asarray(t) / multiple
        return np.array([-np.sin(s), -w / multiple * np.cos(s)])

    start = (guess, 2 * math.pi * multiple / w)
    collocation = st.solve(st.Collocation(system, multiple=multiple), start=start)
    balance = st.HarmonicBalance(system, harmonics=15, subharmonic=multiple)
    return {"collocation": collocation, "balance": st.solve(balance, start=collocation)}


def first_beat(motion: Any) -> tuple[float, float]:
    """(time, |phi|) of the largest swing before the first quiet moment after 5 s."""
    times, values, _ = motion.window(0.0, 9.0).extrema("phi")
    k = int(np.abs(values).argmax())
    return float(times[k]), float(abs(values[k]))


def check(data: dict[str, Any]) -> None:
    """Exponents and beats of the catalogue; the linear motion grows with the exponent."""
    for name, exponent, digits, beat in (("1:1", 0.745666, 5e-7, (6.78, 1.032)), ("2:1", 0.87774, 5e-6, (6.42, 1.630))):
        case = data[name]
        assert abs(case["exponent"] - exponent) < digits
        time, height = first_beat(case["exact"])
        assert abs(time - beat[0]) < 5e-3 and abs(height - beat[1]) < 5e-4
        T = case["linear"].period * (1 if name == "1:1" else 2)  # the multiplier at 2:1 is negative
        growth = math.log(case["linear"](18 * T, "phi") / case["linear"](17 * T, "phi")) / T
        assert abs(growth - case["exponent"]) < 1e-6
    for name, height in (("1:1", 0.70246), ("2:1", 1.13202)):
        one, other = data[name]["orbits"]["collocation"], data[name]["orbits"]["balance"]
        assert one.verdict is st.Verdict.NEUTRAL and abs(one.max["phi"] - height) < 1e-5
        assert abs(other.max["phi"] - one.max["phi"]) < 1e-7
        assert height < first_beat(data[name]["exact"])[1] < 1.5 * height
    largest = np.abs(data["2:1"]["exact"].extrema("phi")[1]).max()
    assert abs(largest - 1.665) < 5e-4
    assert abs(np.abs(data["1:1"]["exact"].extrema("phi")[1]).max() - 1.032) < 1e-3


def draw(data: dict[str, Any], path: Path) -> None:
    """Each case over 30 s; the linear motion leaves the picture."""
    figure, axes = _figure.panels(2, width=7.2, height=2.9, sharey=True)
    figure.get_layout_engine().set(wspace=0.06)
    for axis, (name, (amplitude, _)) in zip(axes, CASES.items()):
        exact, linear = data[name]["exact"].window(0.0, 30.0), data[name]["linear"]
        linear = linear.window(0.0, float(linear.extrema("phi")[0][np.abs(linear.extrema("phi")[1]) > 2.1][0]))
        axis.plot(linear.t, linear["phi"], color=style.COLOURS["orange"], linewidth=0.8, label="linear")
        axis.plot(exact.t, exact["phi"], color=style.SERIES[0], linewidth=0.8, label="exact")
        level = data[name]["orbits"]["collocation"].max["phi"]
        for side in (-level, level):
            axis.axhline(side, color=style.COLOURS["vermilion"], linewidth=0.9, linestyle="--",
                         label="periodic motion" if side > 0 else None)
        time, height = first_beat(exact)
        axis.annotate(f"{height:.3f} rad, {time:.2f} s", (time, height), xytext=(9.5, 1.7), fontsize="small",
                      arrowprops=dict(arrowstyle="-", linewidth=0.5))
        axis.set(xlabel="$t$ (s)", xlim=(0, 30), ylim=(-2.1, 2.1))
        ratio = "w_2" if name == "1:1" else "2w_2"
        _figure.letter(axis, rf"({'a' if name == '1:1' else 'b'}) $w = {ratio}$, $A = {1e3 * amplitude:.0f}$ mm")
    axes[0].set_ylabel(r"$\varphi$ (rad)")
    axes[0].legend(frameon=False, fontsize="small", loc="lower right", ncols=3,
                   columnspacing=1.0, handlelength=1.6)
    _figure.save(figure, path)


def main(folder: Path | str = _figure.OUT) -> list[Path]:
    """Compute, check, draw."""
    return _figure.make(__file__, compute, check, draw, folder)


if __name__ == "__main__":
    main()
