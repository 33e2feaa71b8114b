"""Blocks of mutually coupled states. Witness: permuted block-triangular matrices, whose blocks are known."""

import numpy as np
import pytest

import stability as st
from stability.kernels.block_triangular import mutual_blocks


def test_random_block_triangular_patterns_after_a_permutation():
    random = np.random.default_rng(3)
    for _ in range(200):
        sizes = random.integers(1, 4, size=random.integers(1, 6))
        n, start, pattern, expected = sizes.sum(), 0, np.zeros((sizes.sum(),) * 2, bool), []
        for size in sizes:
            members = np.arange(start, start + size)
            for i in range(size):  # a ring couples the block's members both ways
                pattern[members[i], members[(i + 1) % size]] = True
            pattern[members[0], start + size :] = random.random(n - start - size) < 0.5  # one way only
            expected.append(members)
            start += size
        order = random.permutation(n)
        found = mutual_blocks(pattern[np.ix_(order, order)])
        assert {frozenset(order[b].tolist()) for b in found} == {frozenset(m.tolist()) for m in expected}


def test_two_decoupled_hill_equations_keep_the_accuracy_of_one():
    """At a = 0 both directions of the trap have the same multipliers: an eigenvalue solver would lose half the digits."""
    edge = 0.908046333734577  # zero of the characteristic value b_1
    for q, verdict in ((edge * (1 - 1e-9), st.Verdict.NEUTRAL), (edge * (1 + 1e-9), st.Verdict.UNSTABLE)):
        both = st.monodromy(st.models.paul_trap(), q=q, a=0.0)
        one = st.monodromy(st.models.mathieu_canonical(), q=q, a=0.0)
        assert both.verdict is verdict is one.verdict
        assert np.abs(both.multipliers).max() == pytest.approx(np.abs(one.multipliers).max(), abs=both.error + one.error)
        assert both.error < 1e-7


def test_one_way_coupling_of_the_semi_trivial_solution():
    """The pendulum's variation does not act on the primary: two multipliers are those of the linear oscillator."""
    system = st.models.autoparametric_pendulum(xi1=0.02, xi2=0.01, length_ratio=100.0, Omega0=0.5)
    found = st.monodromy(system, about="linear", Omega=1.0)
    primary = np.exp((-0.02 + 1j * np.sqrt(1 - 0.02**2)) * 2 * np.pi)
    assert np.abs(found.multipliers - primary).min() < 1e-12
