"""The kernels' language: compiled code against the same functions run by Python, bit for bit, and what it refuses."""

from __future__ import annotations

import sys
import threading

import numpy as np
import pytest

from stability.errors import CompileError
from stability.kernels.compiled import B1, C1, C2, H1, I1, R1, R2, kernel

TABLE = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
LIMIT = 3


@kernel(inline=True)
def pair(x, k):  # type: ignore[no-untyped-def]
    """A helper for any types: twice an element, its index."""
    return 2.0 * x[k], k


@kernel(inline=True)
def padded(x, room):  # type: ignore[no-untyped-def]
    """A helper whose result is a new array."""
    out = np.zeros((room, 2))
    for k in range(len(x)):
        out[k, 1] = x[k]
    return out


@kernel
def control(x: R1, counts: I1, flags: B1) -> tuple[float, int, bool]:
    total, last, seen = 0.0, -1, False
    for k in range(x.shape[0]):
        if x[k] < 0.0 and flags[k]:
            continue
        twice, last = pair(x, k)
        total += twice if k % 2 == 0 else -1
        if not (0.5 < abs(x[k]) < 10.0 or k in (0, LIMIT)):
            seen = True
            break
    while last > 0:
        last -= 2
        counts[max(last, 0)] += (-last) // 2 + (-7) % 3
    for k in range(len(counts) - 1, -1, -2):
        counts[k] = counts[k] * 2 if flags[k] else min(counts[k], 4)
    return total, last, seen


@kernel
def numbers(x: R1, out: R2) -> float:
    for k in range(x.shape[0]):
        out[k][0] = x[k] ** 2 - x[k] ** 3 / 7 + TABLE[1, k % 3]
        out[k, 1] = np.sqrt(abs(x[k])) + np.floor(x[k]) * np.round(x[k]) + (abs(x[k]) + 1.0) ** -0.125
        out[k, 2] = max(x[k], -x[k], 0.25) - min(1, x[k])
    rows = out[1:3]
    rows[0, 1], rows[1, 0] = rows[1, 0], rows[0, 1]
    view = out.reshape((out.shape[1], out.shape[0]))
    return view[0, 0] + TABLE[0][2] + (np.inf if x[0] > 1e6 else -0.5)


@kernel
def arrays(x: R1, pivots: H1) -> tuple[R2, I1, float]:
    found, marks = padded(x, len(x) + 1), np.zeros(3, np.int64)
    pivots[0] = len(x) - 5
    same = found.copy()
    same[:] = 7.0
    marks[2] = pivots[0] * 2
    for k in range(3):
        scratch = np.empty(k + 1)
        scratch[k] = k
        found[0, 0] += scratch[k]
    return found[: len(x)], marks, same[0, 1]


@kernel
def complexes(z: C1, M: C2, w: R1) -> float:
    total = 0.0j
    for k in range(z.shape[0]):
        a = z[k] * (1.0 + 2j) - w[k] * z[k] + 1
        b = a / z[k] if w[k] > 0 else a / 2.0
        M[k, 0] = M[k, 1] = -b + np.exp(-0.1 * z[k])
        total += b
    seen = M.view(np.float64)
    return abs(total) + seen[0, 1] + total.real - M[0, 0].imag


@kernel
def tuples(work: tuple[R1, tuple[R2, I1]], factor: float) -> float:
    x, (A, places) = work
    for k in range(x.shape[0]):
        x[k] += factor * A[places[k], 1]
    return work[0][1]


@kernel
def calling(x: R1, out: R2, times: int) -> float:
    """Calls other kernels; arrays that they return live until the end."""
    total = 0.0
    for _ in range(times):
        total += numbers(x, out)
        hold, marks, last = arrays(x, np.zeros(2, np.int32))
        total += hold[1, 1] + last + marks[2]
    return total


RNG = np.random.default_rng(3)
X = RNG.standard_normal(9) * 4


def cases():
    counts, flags = np.arange(9), RNG.random(9) < 0.5
    z = RNG.standard_normal(5) + 1j * RNG.standard_normal(5)
    yield control, (X, counts, flags)
    yield control, (np.abs(X) + 1, counts, ~flags)
    yield numbers, (X, np.zeros((9, 3)))
    yield arrays, (X, np.zeros(1, np.int32))
    yield tuples, ((X.copy(), (RNG.random((3, 2)), np.arange(9) % 3)), -0.3)
    yield calling, (X, np.zeros((9, 3)), 3)
    yield complexes, (z, np.zeros((5, 2), complex), RNG.standard_normal(5))


def copied(value):
    return tuple(map(copied, value)) if isinstance(value, tuple) else np.array(value) if np.ndim(value) else value


def flattened(value):
    return [x for one in value for x in flattened(one)] if isinstance(value, tuple) else [value]


@pytest.mark.parametrize("case", range(7))
def test_compiled_code_gives_the_bits_of_python(case):
    """Complex division and exp differ from Python's by rounding: 4 eps there."""
    function, arguments = list(cases())[case]
    mine, its = copied(arguments), copied(arguments)
    results = flattened((function(*mine), mine)), flattened((function.function(*its), its))
    for a, b in zip(*results, strict=True):
        assert np.shape(a) == np.shape(b)
        if function is complexes:
            assert np.abs(np.asarray(a) - np.asarray(b)).max() <= 4e-15
        else:
            assert np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True)


def test_wrong_arguments_are_type_errors_with_the_argument_s_name():
    out = np.zeros((9, 3))
    cases = [((X,), "takes 2 arguments: x, out"), ((X, 1.0), "'out' of numbers"), ((X, out[0]), "2 dimension"),
             ((X, out.astype(np.float32)), "float64"), ((X, out.astype(">f8")), "float64"), ((X, out.T), "C-contiguous"),
             (("text", out), "'x'")]  # fmt: skip
    for arguments, message in cases:
        with pytest.raises(TypeError, match=message):
            numbers(*arguments)
    out.setflags(write=False)
    with pytest.raises(TypeError, match="writeable"):
        numbers(X, out)
    for factor in ("1", None, 1j):
        with pytest.raises(TypeError):
            tuples((X, (np.ones((1, 2)), np.zeros(9, int))), factor)
    with pytest.raises(TypeError, match="tuple of 2"):
        tuples((X,), 1.0)
    with pytest.raises(TypeError):
        calling(X, np.zeros((9, 3)), 2.5)
    with pytest.raises(OverflowError):
        calling(X, np.zeros((9, 3)), 2**70)


def test_arrays_that_are_only_read_may_be_strided_or_of_a_smaller_type():
    wide, out = np.repeat(X, 2), np.zeros((9, 3))
    assert numbers(wide[::2], out) == numbers.function(X, np.zeros((9, 3)))
    whole = np.arange(9, dtype=np.int32)
    assert numbers(whole, out) == numbers.function(whole.astype(float), np.zeros((9, 3)))


def refused(function):
    with pytest.raises(CompileError) as found:
        function.assembly()
    return str(found.value)


def test_what_the_language_does_not_have_is_refused_with_the_line():
    @kernel
    def negative(x: R1) -> float:
        return x[-1]

    @kernel
    def changes(x: R1) -> float:
        n = 0
        n = x[0]
        return n

    @kernel
    def fancy(x: R1) -> float:
        return np.linalg.norm(x)

    @kernel
    def listed(x: R1) -> float:
        return {1: x[0]}[1]

    @kernel
    def untyped(x) -> float:  # type: ignore[no-untyped-def]
        return x[0]

    assert "no negative indices" in refused(negative) and "'x[-1]'" in refused(negative)
    assert "type i is needed" in refused(changes) and "line 4" in refused(changes)
    assert "np.linalg.norm(x)" in refused(fancy)
    assert "no such expression" in refused(listed)
    assert "no type of x" in refused(untyped)


def test_memory_made_inside_is_given_back():
    """2 10^4 calls that make 3 kB each: 60 MB if they were kept."""
    resource = pytest.importorskip("resource")
    x, out, pivots = np.ones(100), np.zeros((100, 3)), np.zeros(1, np.int32)
    numbers(x, out), arrays(x, pivots)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(20_000):
        arrays(x, pivots)
    scale = 1 if sys.platform == "darwin" else 1024
    assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * scale < 2e7


def test_references_are_counted():
    x, out = np.ones(9), np.zeros((9, 3))
    numbers(x, out)
    before = sys.getrefcount(x), sys.getrefcount(out), sys.getrefcount(None)
    for _ in range(1000):
        numbers(x, out)
        with pytest.raises(TypeError):
            numbers(x, None)
    assert sys.getrefcount(x) == before[0] and sys.getrefcount(out) == before[1]
    assert abs(sys.getrefcount(None) - before[2]) < 100


def test_the_global_lock_is_released():
    """Two threads inside one kernel at a time: the second starts before the first, much longer one, ends."""
    order, x = [], np.ones(9)

    def work(name, times):
        calling(x, np.zeros((9, 3)), times)
        order.append(name)

    threads = [threading.Thread(target=work, args=one) for one in (("long", 100_000), ("short", 1))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert order == ["short", "long"]
