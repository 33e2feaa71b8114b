"""Decisions of the adaption that are taken quickly. Witness: the same ones from the arrays they are short for."""

import numpy as np

import stability as st
from stability.kernels.meshes import monitor
from stability.problems.orbit_adaption import Natural, _fit, natural_sizes, state_scales


def test_scales_fit_where_the_new_ones_are_within_a_factor_of_two():
    random = np.random.default_rng(5)
    fitting = 0
    for _ in range(1000):
        n = random.integers(1, 7)
        values = random.standard_normal((12, n)) * 10.0 ** random.choice([-9, -1, 0, 0, 0, 3], n)
        values[:, random.random(n) < 0.1] = 0.0
        natural = Natural(random.choice([0.0, 0.02], n), random.choice([1.0, 6.0], n))
        new = state_scales(values, natural)
        scales = new * 2.0 ** random.uniform(-1.2, 1.2, n)
        ratios = new / scales
        expected = not ((ratios > 2).any() or (ratios < 0.5).any())
        assert _fit(scales, np.abs(values).max(axis=0), natural) == expected
        fitting += expected
    assert 100 < fitting < 900
    assert _fit(np.ones(2), np.zeros(2), Natural(np.zeros(2), np.ones(2)))


def test_natural_sizes_by_name():
    """Velocities count in 2 pi / P; angles have 0.02 rad, their velocities 0.02 (2 pi / P)."""
    system = st.models.autoparametric_pendulum()
    sizes, units = natural_sizes(system, 4.0)
    rate = 2 * np.pi / 4.0
    assert system.angles
    for k, name in enumerate(system.states):
        coordinate = name.removesuffix("_dot")
        small = 0.02 if coordinate in system.angles else 0.0
        assert units[k] == (rate if name != coordinate else 1.0)
        assert np.isclose(sizes[k], small * units[k])
    assert natural_sizes(system, np.inf).units.tolist() == [1.0] * system.n


def test_the_monitor_without_breaks_is_that_with_all_jumps():
    """A break at an edge takes out its jump: the mean of the two others' sides stays; without breaks both count."""
    random = np.random.default_rng(6)
    for _ in range(100):
        N, n, degree = int(random.integers(2, 30)), int(random.integers(1, 5)), int(random.integers(1, 8))
        edges = np.concatenate([[0.0], np.sort(random.uniform(0.02, 0.98, N - 1)), [1.0]])
        leading = random.standard_normal((N, n))
        middle = (edges[1:] + edges[:-1]) / 2
        after = np.append(middle[1:], middle[0] + 1)
        jump = np.abs(np.roll(leading, -1, axis=0) - leading) / (after - middle)[:, None]
        expected = ((jump + np.roll(jump, 1, axis=0)) / 2).max(axis=1) ** (1 / (degree + 1))
        assert np.allclose(monitor(edges, leading, degree, np.zeros(0)), expected, rtol=1e-13)
        broken = monitor(edges, leading, degree, np.zeros(1))  # a break at 0: no jump from the last to the first
        assert np.allclose(broken[1:-1], expected[1:-1], rtol=1e-13)
        assert np.isclose(broken[0], jump[0].max() ** (1 / (degree + 1)), rtol=1e-13)
