"""Space-time symmetries: planted in random equations and found again, refused where the equations do not have them.

Witnesses: symmetries known by construction (odd springs, mirror-symmetric chains); images of simulated motions are
motions (scipy's DOP853); a term that breaks a symmetry is named by the error.
"""

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import stability as st
from stability.errors import EquationError, InputError, UnknownNameError
from stability.systems.symmetries import verified

t, Omega, k, b = sp.symbols("t Omega k b", real=True)


def chain(spring, second=None, forces=(1, 0, 1), **extra):
    """Three equal masses between walls; `spring(y)` between neighbours; force cos(Omega t) times `forces`."""
    q = [sp.Function(f"q{i}")(t) for i in range(3)]
    ends = [0, *q, 0]
    laws = [spring, second or spring, second or spring, spring]
    pull = [laws[i](ends[i + 1] - ends[i]) for i in range(4)]
    rhs = {
        q[i].diff(t, 2): pull[i + 1] - pull[i] - sp.Rational(1, 10) * q[i].diff(t) + forces[i] * sp.cos(Omega * t)
        for i in range(3)
    }
    return st.System.from_equations(rhs, q, parameters={"Omega": 1.3, "k": 0.7, **extra}, period=2 * sp.pi / Omega)


def shown(system):
    return {repr(s) for s in system.symmetries}


def test_catalogue():
    assert shown(st.models.duffing_textbook()) == {"x -> -x half a forcing period later"}
    assert shown(st.models.autoparametric_pendulum()) == {"theta -> -theta"}
    assert shown(st.models.lorenz()) == {"x -> -x, y -> -y"}
    assert shown(st.models.one_sided_magnet()) == set()
    (one,) = st.models.duffing().symmetries
    assert one.fixed == ("gravity",) and one.proved and one.shift == 0.5
    assert st.models.duffing(gravity=0.3).symmetries == ()
    np.testing.assert_array_equal(one.matrix, -np.eye(2))


def test_mirrored_chain_of_three_masses():
    """Odd springs and equal outer forces: the mirror q1 <-> q3, minus one half a period later, and their product."""
    system = chain(lambda y: y + k * y**3)
    assert shown(system) == {
        "q0 -> -q0, q1 -> -q1, q2 -> -q2 half a forcing period later",
        "q0 -> -q2, q1 -> -q1, q2 -> -q0 half a forcing period later",
        "q0 -> q2, q2 -> q0",
    }
    assert all(s.proved and not s.fixed for s in system.symmetries)
    # springs that are not odd: the mirror turns the chain round, x -> -x of the reversed order
    crooked = chain(lambda y: y + k * y**2, forces=(1, 0, -1))
    assert shown(crooked) == {"q0 -> -q2, q1 -> -q1, q2 -> -q0"}
    assert shown(chain(lambda y: y + k * y**2, forces=(1, 0, 1))) == {
        "q0 -> -q2, q1 -> -q1, q2 -> -q0 half a forcing period later"
    }


@pytest.mark.parametrize("seed", range(6))
def test_planted_symmetries_are_found(seed):
    """Random vector fields made equivariant by averaging f(x) + S f(S x): S is found, and proved."""
    random = np.random.default_rng(seed)
    names = ("a", "b", "c", "d")
    x = sp.symbols(names, real=True)
    order = random.permutation(4)
    S = np.zeros((4, 4), int)
    for i, j in ((order[0], order[1]), (order[2], order[2]), (order[3], order[3])):
        S[i, j] = S[j, i] = random.choice((-1, 1))
    f = [sum(int(random.integers(-3, 4)) * m for m in (x[i], x[i] ** 2, x[i] * x[i - 1], sp.sin(x[i - 2]))) for i in range(4)]
    moved = {s: sum(int(S[i, j]) * x[j] for j in range(4)) for i, s in enumerate(x)}
    image = [e.subs(moved, simultaneous=True) for e in f]
    rhs = tuple(f[i] + sum(int(S[i, j]) * image[j] for j in range(4)) for i in range(4))
    system = st.System(name="planted", coordinates=names, states=names, parameters={}, rhs=rhs)
    found = [s for s in system.symmetries if np.array_equal(s.matrix, S)]
    assert len(found) == 1 and found[0].proved
    for s in system.symmetries:  # whatever else is there is one, too
        point = random.standard_normal(4)
        np.testing.assert_allclose(system(0.0, s.matrix @ point), s.matrix @ system(0.0, point), rtol=1e-12, atol=1e-12)


def test_the_image_of_a_motion_is_a_motion():
    """The pendulum's theta -> -theta and the chain's mirror, by direct integration."""
    for system in (st.models.autoparametric_pendulum(), chain(lambda y: y + k * y**3)):
        for s in system.symmetries:
            start = np.random.default_rng(3).normal(size=system.n) * 0.3
            lag = s.shift * system.period
            settings = dict(method="DOP853", rtol=1e-11, atol=1e-12)
            one = solve_ivp(system, (0, 5), start, **settings).y[:, -1]
            other = solve_ivp(system, (lag, lag + 5), s.matrix @ start, **settings).y[:, -1]
            np.testing.assert_allclose(other, s.matrix @ one, atol=1e-8)


def test_declared_ones_are_verified():
    system = st.models.duffing_textbook()
    good = st.Symmetry({"x": "-x"}, shift=0.5)
    again = system.replace(declared_symmetries=(good,))
    assert again.symmetries == system.symmetries and again.symmetries[0].proved
    assert st.System.from_dict(again.to_dict()) == again
    with pytest.raises(EquationError, match="equation of x_dot changes"):
        system.replace(declared_symmetries=({"x": "-x"},))
    with pytest.raises(EquationError, match="does not have the symmetry u -> -u"):
        verified(st.models.duffing(gravity=0.1), st.Symmetry({"u": "-u"}, shift=0.5))
    with pytest.raises(UnknownNameError, match="did you mean 'theta'"):
        verified(st.models.autoparametric_pendulum(), st.Symmetry({"theto": "-theta"}))
    with pytest.raises(InputError, match="autonomous"):
        verified(st.models.lorenz(), st.Symmetry({"x": "-x", "y": "-y"}, shift=0.5))


def test_descriptions_that_make_no_sense():
    with pytest.raises(InputError, match="shift"):
        st.Symmetry({"x": "-x"}, shift=0.25)
    with pytest.raises(InputError, match="neither a state"):
        st.Symmetry({"x": "2*x"})
    with pytest.raises(InputError, match="mapping"):
        st.Symmetry(3)
    with pytest.raises(InputError, match="same image"):
        st.Symmetry({"x": "y"}).completed(("x", "y"))
    with pytest.raises(InputError, match="applied twice"):
        st.Symmetry({"x": "y", "y": "-x"}).completed(("x", "y"))


def test_python_functions_have_symmetries_that_are_seen_but_not_proved():
    def spring(time, x, *, Omega=1.2, stiff=0.5):
        return x[1], -0.1 * x[1] - x[0] - stiff * x[0] ** 3 + np.cos(Omega * time)

    system = st.System.from_function(spring, "q q_dot", period="2*pi/Omega")
    (one,) = system.symmetries
    assert repr(one) == "q -> -q half a forcing period later" and not one.proved
    declared = st.System.from_function(
        spring, "q q_dot", period="2*pi/Omega", symmetries=[st.Symmetry({"q": "-q"}, shift=0.5)]
    )
    assert declared.symmetries == (one,)


def test_stops_are_carried_along():
    both = st.models.hard_stop_oscillator()
    assert len(both.symmetries) == 1
    assert both.replace(stops=both.stops[:1]).symmetries == ()


def test_large_systems_are_tried_by_signs_and_reversal():
    names = [f"q{i}" for i in range(9)]
    x = sp.symbols(names, real=True)
    rhs = tuple((x[i - 1] if i else 0) + (x[i + 1] if i < 8 else 0) - 2 * x[i] - b * x[i] ** 3 for i in range(9))
    system = st.System(name="line", coordinates=names, states=names, parameters={"b": 1.0}, rhs=rhs)
    reversal = np.eye(9)[::-1]
    matrices = [s.matrix for s in system.symmetries]
    for S in (-np.eye(9), reversal, -reversal):
        assert any(np.array_equal(S, m) for m in matrices)
