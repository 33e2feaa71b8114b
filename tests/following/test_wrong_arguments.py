"""What is given in the wrong place is refused in words, before any work starts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import stability as st
from stability.errors import InputError, UnknownNameError

SYSTEM = st.models.duffing(xi=0.02, beta=0.001)
CALLS: dict[str, Callable[[Any], Any]] = {
    "continuation": lambda given: st.continuation(given, "Omega", (1, 2)),
    "solve": lambda given: st.solve(given),
    "families": lambda given: st.families(given, "Omega", (1, 2)),
    "loci": lambda given: st.loci(given, "Omega", (1, 2), free="beta", free_window=(0, 1)),
    "steps": lambda given: st.steps(given, "Omega", (1, 2)),
    "steps without a window": lambda given: st.steps(given),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS.keys())
def test_a_problem_is_needed(call: Callable[[Any], Any]) -> None:
    """The forgotten problem of a new user: the sentence holds what to write instead."""
    with pytest.raises(
        InputError, match=r"'duffing' is a system.*st\.Collocation\(system\).*st\.Equilibrium\(system\)"
    ):
        call(SYSTEM)
    with pytest.raises(InputError, match=r"a problem is needed.*got str"):
        call("duffing")


@pytest.mark.parametrize("given", [dict(events=3), dict(events="u"), dict(stop_at=3), dict(at="one"), dict(at=None)])
def test_arguments_of_another_type(given: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=next(iter(given))):
        st.continuation(st.Collocation(SYSTEM), "Omega", (1, 2), **given)


def test_kinds_of_curves_by_name() -> None:
    """An unknown word lists the known ones; a single word is one kind, not its letters."""
    problem, rest = st.Collocation(SYSTEM), dict(free="beta", free_window=(0.0005, 0.001), cuts=1)
    with pytest.raises(UnknownNameError, match=r"no kind of curve 'fald'.*did you mean 'fold'"):
        st.loci(problem, "Omega", (1, 2), kinds=("fald",), **rest)
    with pytest.raises(InputError, match="no curves of 'cusp' points"):
        st.loci(problem, "Omega", (1, 2), kinds="cusp", **rest)


@pytest.mark.parametrize("problem", [st.Collocation, st.Shooting])
def test_several_periods_of_a_forcing_that_is_not_there(problem: Any) -> None:
    with pytest.raises(InputError, match="multiple = 2: 'van_der_pol' is autonomous"):
        problem(st.models.van_der_pol(), multiple=2)
