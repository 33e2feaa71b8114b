r"""Boundaries of the Strutt chart as power series in the modulation, to any order, with rational coefficients.

    y'' + 2 mu y' + (a - 2 q cos 2t) y = 0                                                     (canonical, DLMF 28.2)

Periodic solutions y = sum c_k e^{ikt}, k = n mod 2, obey D_k c_k = q (c_{k-2} + c_{k+2}), D_k = a - k^2 + 2 i mu k.
Eliminating all but c_n and c_{-n} (a chain above n by a continued fraction, the block between by determinants) leaves

    (a - n^2 - Re S)^2 + (2 n mu - Im S)^2 = C^2,      S = S_above + S_between,   C = q^n / det(between),

    a = n^2 + Re S +- sqrt(C^2 - (2 n mu - Im S)^2) = M +- sqrt(G),

which is iterated in power series of q, each round right to one order more. With damping, mu = m q^n is of the order of
the tongue's width and the coefficients lie in Q(m)[r], r^2 = C_n^2 - 4 n^2 m^2, C_n = 1/(4^(n-1) (n-1)!^2).
References: McLachlan (1947), 2.13; DLMF 28.6; Levy and Keller, Comm. Pure Appl. Math. 16 (1963) 469 (the width).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import sympy as sp
from sympy.polys.domains import QQ

from ..errors import InputError

__all__ = ["transition_series"]

Series = list[Any]
Pair = tuple[Series, Series]


@dataclass(frozen=True)
class _Rooted:
    """x + y r with r^2 = L, in the field Q(m)."""

    x: Any
    y: Any
    L: Any

    def __add__(self, other: _Rooted) -> _Rooted:
        return _Rooted(self.x + other.x, self.y + other.y, self.L)

    def __sub__(self, other: _Rooted) -> _Rooted:
        return _Rooted(self.x - other.x, self.y - other.y, self.L)

    def __mul__(self, other: _Rooted) -> _Rooted:
        return _Rooted(self.x * other.x + self.y * other.y * self.L, self.x * other.y + self.y * other.x, self.L)

    def over(self, number: Any) -> _Rooted:
        """Divided by an element of Q(m)."""
        return _Rooted(self.x / number, self.y / number, self.L)


class _Arithmetic:
    """Power series in q up to `order`, over Q or over Q(m)[r]."""

    def __init__(self, n: int, order: int, damping: bool) -> None:
        self.n, self.order, self.damping = n, order, damping
        self.m = sp.Symbol("m")
        width = Fraction(1)
        for k in range(1, n):
            width /= Fraction(4 * k * k)
        self.width = width
        if damping:
            self.field = QQ.frac_field(self.m)
            m = self.field.gens[0]
            self.L = self.field(QQ(width.numerator, width.denominator)) ** 2 - 4 * n**2 * m**2
            self.root: Any = _Rooted(self.field.zero, self.field.one, self.L)
            self.mu = self.power(_Rooted(m, self.field.zero, self.L), n)
        else:
            self.root = width
            self.mu = self.power(Fraction(0), n)

    def number(self, value: int | Fraction) -> Any:
        """A rational as a coefficient."""
        value = Fraction(value)
        if not self.damping:
            return value
        return _Rooted(self.field(QQ(value.numerator, value.denominator)), self.field.zero, self.L)

    def divided(self, coefficient: Any, number: Any) -> Any:
        """coefficient / number, number rational (a coefficient) or r^2."""
        if not self.damping:
            return coefficient / number
        return coefficient.over(number.x)

    def power(self, coefficient: Any, k: int) -> Series:
        """coefficient * q^k."""
        zero = self.number(0) if not self.damping else _Rooted(self.field.zero, self.field.zero, self.L)
        out = [zero] * (self.order + 1)
        if k <= self.order:
            out[k] = coefficient
        return out

    def constant(self, value: int | Fraction) -> Series:
        """A rational as a series."""
        return self.power(self.number(value), 0)

    def plus(self, a: Series, b: Series) -> Series:
        """a + b."""
        return [x + y for x, y in zip(a, b)]

    def minus(self, a: Series, b: Series) -> Series:
        """a - b."""
        return [x - y for x, y in zip(a, b)]

    def times(self, a: Series, b: Series) -> Series:
        """a b."""
        out = self.constant(0)
        for i, x in enumerate(a):
            for j in range(self.order + 1 - i):
                out[i + j] = out[i + j] + x * b[j]
        return out

    def shifted(self, a: Series, k: int) -> Series:
        """q^k a."""
        return (self.constant(0)[:k] + a)[: self.order + 1]

    def inverse(self, a: Series) -> Series:
        """1/a for a rational a_0."""
        out = [self.divided(self.number(1), a[0])]
        for k in range(1, self.order + 1):
            total = self.number(0)
            for j in range(1, k + 1):
                total = total + a[j] * out[k - j]
            out.append(self.divided(self.number(0) - total, a[0]))
        return out

    def square_root(self, a: Series) -> Series:
        """sqrt(a), a = r^2 + O(q)."""
        square = self.root * self.root
        out = [self.root]
        for k in range(1, self.order + 1):
            total = a[k] if k < len(a) else self.number(0)
            for j in range(1, k):
                total = total - out[j] * out[k - j]
            # total / (2 r) = total r / (2 r^2)
            out.append(self.divided(self.divided(total * self.root, square), self.number(2)))
        return out

    # pairs: real and imaginary part
    def pair_times(self, a: Pair, b: Pair) -> Pair:
        """Complex product."""
        return (
            self.minus(self.times(a[0], b[0]), self.times(a[1], b[1])),
            self.plus(self.times(a[0], b[1]), self.times(a[1], b[0])),
        )

    def pair_inverse(self, a: Pair) -> Pair:
        """Complex inverse."""
        size = self.inverse(self.plus(self.times(a[0], a[0]), self.times(a[1], a[1])))
        return self.times(a[0], size), self.minus(self.constant(0), self.times(a[1], size))


def _round(work: _Arithmetic, a: Series, sign: int) -> Series:
    """One iteration of the equation at the module's head."""
    n, order = work.n, work.order
    zero = work.constant(0)

    def diagonal(k: int) -> Pair:
        return work.minus(a, work.constant(k * k)), work.times(work.constant(2 * k), work.mu)

    above: Pair = (zero, zero)
    for k in range(n + 2 * (order // 2 + 1), n, -2):
        D = diagonal(k)
        below = work.pair_inverse((work.minus(D[0], above[0]), work.minus(D[1], above[1])))
        above = work.shifted(below[0], 2), work.shifted(below[1], 2)
    # determinants of the block from k downwards to -(n - 2): d_k = D_k d_{k-2} - q^2 d_{k-4}
    last: Pair = (work.constant(1), zero)
    before: Pair = (zero, zero)
    for k in range(-(n - 2), n - 1, 2):
        product = work.pair_times(diagonal(k), last)
        shift = work.shifted(before[0], 2), work.shifted(before[1], 2)
        before, last = last, (work.minus(product[0], shift[0]), work.minus(product[1], shift[1]))
    inverse = work.inverse(last[0])  # the determinant is real: the block is its own conjugate read backwards
    between = (zero, zero) if n == 1 else tuple(work.shifted(work.times(p, inverse), 2) for p in before)
    real, imaginary = work.plus(above[0], between[0]), work.plus(above[1], between[1])
    # C^2 - (2 n mu - Im S)^2 = q^(2n) (r^2 + ...): both divided by q^n
    loss = work.minus(work.times(work.constant(2 * n), work.mu), imaginary)
    loss = loss[n:] + [work.number(0)] * n
    root = work.square_root(work.minus(work.times(inverse, inverse), work.times(loss, loss)))
    half = work.shifted(root, n)
    mean = work.plus(work.constant(n * n), real)
    return work.plus(mean, half) if sign > 0 else work.minus(mean, half)


def transition_series(n: int, order: int = 6, *, damping: bool = False) -> tuple[sp.Expr, ...]:
    r"""Power series of the boundaries of the n-th instability tongue of Mathieu's equation.

    y'' + 2 mu y' + (a - 2 q cos 2t) y = 0. Without damping the two curves are the Mathieu numbers b_n(q), a_n(q).

    Parameters
    ----------
    n : int
        Tongue: the response has n half-periods in the period of the modulation; 0 for the curve a_0 (without damping).
    order : int
        Highest power of q (with damping: of q, counting mu as q^n).
    damping : bool
        With mu as a symbol, M +- sqrt(G), G = C_n^2 q^(2n) - 4 n^2 mu^2 + ...: the two curves meet in the tip G = 0.

    Returns
    -------
    tuple of sympy expressions in q (and mu)
        (lower, upper) for q > 0, which is (b_n, a_n); (a_0,) for n = 0. All coefficients are rational numbers.

    Raises
    ------
    InputError
        n or order negative or too large; damping for n = 0; with damping, an order below n.

    Notes
    -----
    *Accuracy*: the error is O(q^(order + 1)); compared with `mathieu_a`, `mathieu_b` and Floquet theory. The series of
    n converges for |q| below about 1.47 (n = 1) to 2 n^2.

    References
    ----------
    McLachlan, Theory and Application of Mathieu Functions (1947), 2.13; DLMF 28.6(i).

    Examples
    --------
    >>> import stability as st
    >>> st.transition_series(1, 3)
    (q**3/64 - q**2/8 - q + 1, -q**3/64 - q**2/8 + q + 1)
    >>> st.transition_series(1, 2, damping=True)[1]
    -q**2/8 + sqrt(-4*mu**2 + q**2) + 1
    """
    for label, value, top in (("n", n, 40), ("order", order, 60)):
        if isinstance(value, bool) or int(value) != value or not 0 <= value <= top:
            raise InputError(f"{label} = {value!r}: an integer from 0 to {top} is needed")
    n, order = int(n), int(order)
    if damping and (n == 0 or order < n):
        raise InputError(
            f"the damped tongue {n} needs n >= 1 and order >= n (its width is of order q^n); got order = {order}"
        )
    q = sp.Symbol("q", real=True)
    if n == 0:
        return (_zeroth(order, q),)
    work = _Arithmetic(n, order, damping)
    curves = []
    for sign in (-1, 1):
        a = work.constant(n * n)
        for _ in range(order + 1):
            following = _round(work, a, sign)
            if following == a:
                break
            a = following
        curves.append(a)
    if not damping:
        return tuple(_expression(a, q) for a in curves)
    mean, square = _damped(work, curves[1], q)
    return mean - sp.sqrt(square), mean + sp.sqrt(square)


def _zeroth(order: int, q: sp.Symbol) -> sp.Expr:
    """a_0: D_0 = 2 S_above of the chain from 2 upwards (c_2 = c_-2)."""
    work = _Arithmetic(1, order, False)
    a = work.constant(0)
    for _ in range(order + 1):
        above = work.constant(0)
        for k in range(2 * (order // 2 + 2), 0, -2):
            below = work.inverse(work.minus(work.minus(a, work.constant(k * k)), above))
            above = work.shifted(below, 2)
        a = work.plus(above, above)
    return _expression(a, q)


def _expression(a: Series, q: sp.Symbol) -> sp.Expr:
    """The series with rational coefficients as sympy expression."""
    return sp.Add(*(sp.Rational(c.numerator, c.denominator) * q**k for k, c in enumerate(a)))


def _damped(work: _Arithmetic, a: Series, q: sp.Symbol) -> tuple[sp.Expr, sp.Expr]:
    """M and G of a = M +- sqrt(G), polynomials in q and mu = m q^n; a = sum (x_k + y_k r) q^k, G = r^2 (sum y_k q^k)^2.

    The two curves are the roots of a quadratic with analytic coefficients, so that M and G hold in the tip, too.
    """
    n, mu = work.n, sp.Symbol("mu", real=True)

    def term(value: Any, k: int) -> sp.Expr:
        return sp.expand(sp.cancel(value.as_expr()).subs(work.m, mu / q**n) * q**k)

    mean = sp.Add(*(term(c.x, k) for k, c in enumerate(a)))
    slopes = [c.y for c in a[n:]]
    square = sp.S.Zero
    for k in range(len(slopes)):
        square += term(work.L * sum((slopes[i] * slopes[k - i] for i in range(k + 1)), work.field.zero), 2 * n + k)
    return mean, square
