"""Passages and extrema of piecewise polynomials whose joints lie where they count: sines and parabolas in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from stability.kernels import piecewise


def pieces(function, edges):
    edges = np.asarray(edges, float)
    return edges, piecewise.from_nodes(function(piecewise.node_times(edges))[..., None])[..., 0]


@pytest.mark.parametrize("error", [-1e-15, 0.0, 1e-15])
def test_a_passage_at_the_end_of_a_step_is_there_once(error):
    zeros = np.pi * np.arange(1, 8)
    edges = np.sort(np.concatenate([[0.3], zeros + error, zeros - 1.2, [23.0]]))
    edges, column = pieces(np.sin, edges)
    assert np.abs(piecewise.crossings(edges, column) - zeros).max() < 1e-13
    assert np.abs(piecewise.crossings(edges, column, +1) - zeros[1::2]).max() < 1e-13
    assert np.abs(piecewise.crossings(edges, column, -1) - zeros[::2]).max() < 1e-13


def test_neighbouring_pieces_that_disagree_by_rounding_neither_double_nor_miss():
    edges, column = pieces(lambda s: s, [-1.0, 0.0, 1.0])
    for left, right in [(1e-16, -1e-16), (-1e-16, 1e-16), (1e-17, 1e-17)]:
        shifted = column + np.array([[left], [right]]) * (np.arange(8) == 0)
        assert piecewise.crossings(edges, shifted).size == 1


def test_intervals_are_open_at_the_start_and_closed_at_the_end():
    edges, column = pieces(lambda s: s, [-1.0, -0.5, 0.0])
    assert piecewise.crossings(edges, column, 1) == pytest.approx([0.0], abs=1e-15)
    edges, column = pieces(lambda s: s, [0.0, 0.5, 1.0])
    assert piecewise.crossings(edges, column).size == 0


def test_a_touch_is_no_passage_and_a_jump_is_none():
    edges, column = pieces(lambda s: s**2, [-1.0, 0.0, 1.0])
    assert piecewise.crossings(edges, column).size == 0
    edges, column = pieces(lambda s: -np.ones_like(s), [0.0, 0.5])
    column = np.vstack([column, -column])
    assert piecewise.crossings(np.array([0.0, 0.5, 1.0]), column).size == 0


def test_level_counts_towards_rounding():
    edges, column = pieces(lambda s: 1e6 + np.sin(s), [0.5, np.pi, 4.0, 2 * np.pi, 7.0])
    assert np.abs(piecewise.crossings(edges, column, level=1e6) - [np.pi, 2 * np.pi]).max() < 1e-9


def test_extrema_at_joints_and_at_corners():
    edges, column = pieces(np.cos, [-0.5, 0.0, 1.0, np.pi, np.pi + 1e-14, 4.0, 2 * np.pi, 7.0])
    times, values, signs = piecewise.extrema(edges, column)
    assert signs.tolist() == [1, -1, 1] and np.abs(times - np.pi * np.arange(3)).max() < 1e-7
    assert np.abs(values - [1, -1, 1]).max() < 1e-14
    edges, column = pieces(lambda s: 1 - np.abs(s), [-1.0, 0.0, 1.0])
    times, values, signs = piecewise.extrema(edges, column)
    assert (times.tolist(), values.tolist(), signs.tolist()) == ([0.0], [pytest.approx(1.0)], [1.0])
