"""LLVM IR text of a table lookup: bisection for the piece, Horner in it, the same operations as `Table.evaluate`.

The breakpoints b_0 ... b_K and the rows of coefficients (one for each piece, two for the outside) become constants of
the module. The piece of x is k = #{i < K: b_i <= x} + (x > b_K); comparisons with NaN are false, so a NaN goes to row 0
and comes out as NaN.
"""

from __future__ import annotations

import struct
from typing import Any

from .tables import Table

__all__ = ["number", "table_function"]


def number(value: float) -> str:
    """A double as LLVM text, exact to the bit."""
    return f"0x{struct.unpack('>Q', struct.pack('>d', value))[0]:016X}"


def table_function(table: Table, name: str, pointer: str) -> str:
    """Bisection for the piece, Horner in it: the same operations as `Table.evaluate`."""
    breaks, rows = table.breakpoints, table.rows
    last, width = len(breaks) - 1, rows.shape[1]

    def array(values: Any) -> str:
        return f"[{len(values)} x double] [{', '.join(f'double {number(float(v))}' for v in values)}]"

    def entry(suffix: str, size: int, register: str) -> str:
        kind = f"[{size} x double]"
        source = f"{kind}*" if pointer != "ptr" else "ptr"
        return f"getelementptr {kind}, {source} @{name}_{suffix}, i64 0, i64 {register}"

    horner = [f"%a{width - 1} = getelementptr double, {pointer} %row, i64 {width - 1}"]
    horner.append(f"%c{width - 1} = load double, {pointer} %a{width - 1}")
    result = f"%c{width - 1}"
    for j in range(width - 2, -1, -1):
        horner += [
            f"%m{j} = fmul double {result}, %distance",
            f"%a{j} = getelementptr double, {pointer} %row, i64 {j}",
            f"%c{j} = load double, {pointer} %a{j}",
            f"%v{j} = fadd double %m{j}, %c{j}",
        ]
        result = f"%v{j}"
    if width == 1:
        horner += ["%m0 = fmul double 0x0000000000000000, %distance", "%v0 = fadd double %m0, %c0"]
        result = "%v0"
    joined = "\n  ".join(horner)
    return f"""
@{name}_breaks = internal constant {array(breaks)}
@{name}_rows = internal constant {array(rows.ravel())}
define internal double @{name}(double %x) {{
entry:
  br label %search
search:
  %low = phi i64 [0, %entry], [%new_low, %step]
  %high = phi i64 [{last}, %entry], [%new_high, %step]
  %open = icmp slt i64 %low, %high
  br i1 %open, label %step, label %found
step:
  %sum = add i64 %low, %high
  %middle = lshr i64 %sum, 1
  %at = {entry("breaks", last + 1, "%middle")}
  %break = load double, {pointer} %at
  %right = fcmp ole double %break, %x
  %after = add i64 %middle, 1
  %new_low = select i1 %right, i64 %after, i64 %low
  %new_high = select i1 %right, i64 %high, i64 %middle
  br label %search
found:
  %beyond = fcmp ogt double %x, {number(float(breaks[-1]))}
  %one_more = zext i1 %beyond to i64
  %piece = add i64 %low, %one_more
  %inside = icmp sgt i64 %piece, 0
  %before = sub i64 %piece, 1
  %origin = select i1 %inside, i64 %before, i64 0
  %origin_at = {entry("breaks", last + 1, "%origin")}
  %centre = load double, {pointer} %origin_at
  %distance = fsub double %x, %centre
  %offset = mul i64 %piece, {width}
  %row = {entry("rows", rows.size, "%offset")}
  {joined}
  ret double {result}
}}"""
