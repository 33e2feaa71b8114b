"""What the compiled march says of multipliers and segments, beside the driver's own functions in Python.

Witness: `orbit_spectrum`, `liouville_gap`, `smooth_tests` for the readings; `changes`, `double_turn`, `dip_of` and
`_foretold` for segments, on random triples of neighbouring points: a quiet segment is one where they see nothing.
"""

import math

import numpy as np
import pytest

from stability.following import events, searching
from stability.following.points import Point, smooth_tests
from stability.kernels.caching import kernel
from stability.kernels.quiet_segments import carried, quiet, reading
from stability.problems.collocation_error import TRUST
from stability.problems.orbit_spectrum import liouville_gap, orbit_spectrum
from stability.protocols import Critical, Spectrum, Tangent
from stability.words import Kind, Verdict

WATCH = searching.WATCH


class OnTheCircle:
    critical = Critical(True, Kind.NEIMARK_SACKER, -1.0)


@kernel
def read(re, im, count, known, trust, rough, growth, orientation, rounding, out):
    error = carried(known[1], rough, trust) * known[0]
    return reading(re, im, count, error, trust, growth, orientation, rounding, out)


@kernel
def is_quiet(re, im, k, count, readings, signs, rates, steps, gap, moved, watch):
    return quiet(re, im, k, count, readings, signs, rates, steps, gap, moved, watch)


def multipliers(rng, count, radius):
    """Random multipliers, real ones and conjugate pairs, by descending modulus."""
    values = []
    while len(values) < count:
        size = radius * np.exp(rng.normal(0, 0.6))
        if count - len(values) >= 2 and rng.random() < 0.5:
            z = size * np.exp(1j * rng.uniform(0.05, 3.09))
            values += [z, z.conjugate()]
        else:
            values.append(complex(size * rng.choice([1, -1])))
    return np.array(sorted(values, key=lambda z: (-abs(z), -z.imag)))


def read_in_kernel(values, known=(1e-12, 1.0), rough=1.0, growth=0.0, sign=1.0, rounding=0.0):
    out = np.empty(9)
    complete = read(values.real.copy(), values.imag.copy(), len(values), known, TRUST, rough, growth, sign, rounding, out)
    return complete, out


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6])
def test_readings_are_those_of_the_driver(count):
    rng = np.random.default_rng(count)
    seen = 0
    for _ in range(400):
        values = multipliers(rng, count, 0.9)
        volume = float(np.prod(values).real)
        growth, sign = math.log(abs(volume)) + rng.normal(0, 1e-4), math.copysign(1.0, volume)
        complete, out = read_in_kernel(values, rough=1.5, growth=growth, sign=sign, rounding=1e-15)
        expected = orbit_spectrum(values, 3 * 1.5**2 * 1e-12 + 1e-15 + liouville_gap(values, growth, sign))
        assert out[2:6].tolist() == [expected.unstable, expected.beyond_plus, expected.beyond_minus, expected.pairs]
        assert out[6:] == pytest.approx(smooth_tests(values, True), rel=1e-12, abs=1e-14)
        if complete:
            seen += 1
            assert out[0] == pytest.approx(expected.error, rel=1e-6)
            assert {1.0: Verdict.STABLE, -1.0: Verdict.UNSTABLE}[out[1]] is expected.verdict
    assert seen > 200


def test_readings_that_are_in_doubt_are_left_alone():
    inside = np.array([0.5 + 0.1j, 0.5 - 0.1j])
    growth = math.log(0.26)
    assert read_in_kernel(inside, growth=growth)[0]
    assert not read_in_kernel(inside, known=(np.inf, 0.0), growth=growth)[0]  # nothing known of the mesh
    assert not read_in_kernel(inside, rough=1.01 * TRUST[1], growth=growth)[0]  # the orbit has become much rougher
    assert not read_in_kernel(inside, known=(1e-3, 1.0), growth=growth)[0]  # too inaccurate for its distance
    assert not read_in_kernel(np.array([1.0 + 1e-7 + 0j, 0.5]), growth=math.log(0.5))[0]  # near the circle
    assert not read_in_kernel(np.array([0.9 + 0j, 1e-14]), growth=-35.0)[0]  # lost in the product
    assert not read_in_kernel(np.array([0.9 + 0j, 1e-5]), growth=-35.0)[0]  # a product too large
    assert not read_in_kernel(np.array([np.nan + 0j, 0.5]))[0]
    assert not read_in_kernel(inside, growth=math.log(0.9))[0]  # Liouville's formula takes the verdict away


def random_triple(rng, count):
    """Three neighbouring points whose multipliers move a little, or by much, with all that the driver compares."""
    pace = rng.choice([0.02, 0.1, 0.3])
    first = multipliers(rng, count, rng.choice([0.6, 0.97, 1.2]))
    points, s, parameter = [], 0.0, 0.0
    motion = rng.normal(0, pace, count)
    bend = rng.normal(0, 2 * pace, count) * rng.integers(0, 2)
    rate = rng.normal()
    for k in range(3):
        grown = first * np.exp(motion * k + bend * (k - 1) ** 2)
        pairs = first.imag != 0
        grown[pairs] = np.repeat(grown[pairs][::2], 2)
        grown[np.flatnonzero(pairs)[1::2]] = grown[np.flatnonzero(pairs)[::2]].conj()
        step = rng.uniform(0.5, 1.5)
        s, parameter = s + step, parameter + step * rate
        counts = orbit_spectrum(grown, 1e-12)
        spectrum = Spectrum(grown, 1e-12, *counts[2:6], Verdict.STABLE)
        tangent = Tangent(np.zeros(1), rate, 1.0)
        rate += rng.normal(0, 0.3 * pace) * abs(rate)
        points.append(Point(
            OnTheCircle(), np.zeros(1), np.zeros(1), parameter, tangent, spectrum, smooth_tests(grown, True), 1, 0.0, 2, s,
            step,
        ))  # fmt: skip
    return tuple(points)


def sees_something(points):
    """Whether the driver would look at the segment between the last two of three points."""
    _, a, b = points
    if not events.changes(a, b).nothing or events.changes(a, b).collision or events.double_turn(a, b) is not None:
        return True
    triples = events.matched(points)
    dips = (events.dip_of(points, which, triples) for which in searching._tests(b))
    return any(dip is not None and dip.depth < WATCH[0] for dip in dips) or searching._foretold(points, triples)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6])
def test_quiet_segments_are_those_where_the_driver_sees_nothing(count):
    rng = np.random.default_rng(10 + count)
    found = {(True, True): 0, (True, False): 0, (False, True): 0, (False, False): 0}
    for _ in range(1500):
        points = random_triple(rng, count)
        re, im, readings = np.empty((3, count)), np.empty((3, count)), np.empty((3, 9))
        for row, p in enumerate(points):
            re[row], im[row] = p.spectrum.values.real, p.spectrum.values.imag
            readings[row, 2:] = (*p.spectrum[2:6], *p.tests)
        rates = tuple(float(p.tangent.parameter) for p in points)
        before, a, b = points
        said = is_quiet(
            re, im, 1, count, readings, np.ones(3), rates, (a.step, b.step), a.s - before.s, b.parameter - a.parameter,
            WATCH,
        )  # fmt: skip
        found[bool(said), sees_something(points)] += 1
    assert found[True, True] == 0
    assert found[True, False] > 2 * found[False, False] and found[False, True] > 50


def test_more_than_six_multipliers_are_never_quiet():
    values = np.full((3, 7), 0.5)
    readings = np.zeros((3, 9))
    readings[:, 6:] = 1.0
    assert not is_quiet(values, 0 * values, 1, 7, readings, np.ones(3), (1.0, 1.0, 1.0), (1.0, 1.0), 1.0, 1.0, WATCH)
    few = values[:, :1].copy()
    assert is_quiet(few, 0 * few, 1, 1, readings, np.ones(3), (1.0, 1.0, 1.0), (1.0, 1.0), 1.0, 1.0, WATCH)
