"""`compare`. Witnesses: HB1's closed form for the averaged error, folds of ten digits, planted missing solutions."""

import warnings

import numpy as np
import pytest

import stability as st
from stability.comparing.matching import matched
from stability.errors import InputError, UnknownNameError
from stability.words import Verdict

S, U, N = Verdict.STABLE, Verdict.UNSTABLE, Verdict.UNDETERMINED


@pytest.fixture(scope="module")
def results():
    duffing = st.models.duffing(xi=0.02, beta=0.001)
    window = (0.3, 3.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", st.errors.StabilityWarning)
        return {
            "full": st.continuation(st.Collocation(duffing), "Omega", window),
            "slow": st.continuation(st.Equilibrium(st.averaging(duffing)), "Omega", window),
            "hb1": st.continuation(st.HarmonicBalance(duffing, harmonics=1), "Omega", window),
            "hb7": st.continuation(st.HarmonicBalance(duffing, harmonics=7), "Omega", window),
            "up": st.sweep(duffing, "Omega", (1.0, 1.5)),
        }


def test_methods_against_collocation(results):
    r = results
    c = st.compare(r["full"], r["slow"], r["hb1"], r["hb7"], r["up"], points=41)
    assert list(c.differences) == ["averaging", "harmonic balance 1", "harmonic balance 7", "sweep up"]
    assert c.reference == "collocation" and c.quantity == "u.amplitude(1)"
    assert c["harmonic balance 7"].worst < 1e-9 and not c["harmonic balance 7"].missing
    assert 1e-3 < c["harmonic balance 1"].worst < 0.05
    # averaging in these variables has the equilibria of one-harmonic balance
    assert c["averaging"].worst == pytest.approx(c["harmonic balance 1"].worst, rel=1e-6)
    assert c["sweep up"].worst < 1e-3
    folds = dict(c["harmonic balance 7"].folds)
    assert sorted(folds) == pytest.approx([1.088436639, 1.380933030], abs=2e-9)
    assert all(abs(there - here) < 1e-9 for here, there in folds.items())


def test_methods_are_found_by_either_name(results):
    """As `responses` calls them and as tables do: the very same entry."""
    c = st.compare(results["full"], results["slow"], results["hb7"], results["up"], points=3)
    for word, name in (("hb7", "harmonic balance 7"), ("averaging", "averaging"), ("sweep-up", "sweep up")):
        assert c[word] is c[name]
    with pytest.raises(UnknownNameError, match="no method 'hb9'"):
        c["hb9"]
    r = st.responses(st.models.duffing(xi=0.02, beta=0.001), "Omega", (0.5, 0.7), ("hb3", "averaging2"), points=3)
    assert list(r) == ["hb3", "averaging2"] and "harmonic balance 3" in r and "hb5" not in r
    assert r["averaging, order 2"] is r["averaging2"]


def test_what_a_method_misses_is_counted(results):
    """Between its own top fold and the true one, one-harmonic balance has one solution, the truth three."""
    c = st.compare(results["full"], results["hb1"], points=541)
    (low,) = [there for here, there in c["harmonic balance 1"].folds if here > 1.3]
    near_the_top = [(p, v) for p, v, _ in c["harmonic balance 1"].missing if p > 1.3]
    assert near_the_top and all(low <= p <= 1.3809331 for p, _ in near_the_top)
    assert {v for _, v in near_the_top} == {S, U}


@pytest.mark.parametrize("stopped_is_reference", [False, True])
def test_a_branch_that_stops_at_its_fold_is_matched_with_its_own_sheet(stopped_is_reference):
    """Below the top fold collocation has the same upper solution; its lower one (amplitude 0.2 for 2.5) is another."""
    duffing = st.models.duffing(xi=0.02, beta=0.001)
    whole = st.continuation(st.Collocation(duffing), "Omega", (0.3, 3.0))
    part = st.continuation(st.HarmonicBalance(duffing, harmonics=9), "Omega", (0.3, 3.0), stop_at=("LP",))
    pair = (part, whole) if stopped_is_reference else (whole, part)
    (found,) = st.compare(*pair, points=15).differences.values()
    assert found.parameter.size == 15 and found.worst < 1e-7
    left, none = (found.extra, found.missing) if stopped_is_reference else (found.missing, found.extra)
    assert {verdict for _, verdict, _ in left} == {S, U} and not none


def test_table_plot_and_columns(results):
    import matplotlib.pyplot as plt

    c = st.compare(results["full"], results["hb7"], results["up"], points=11)
    assert "fold at 1.38093303" in c.table() and "harmonic balance 7" in repr(c)
    figure, axes = plt.subplots()
    artists = c.plot(ax=axes)
    assert artists and axes.get_ylabel() and {t.get_text() for t in axes.get_legend().get_texts()} == set(c.names)
    plt.close(figure)
    columns = c.to_dict()
    assert len({v.size for v in columns.values()}) == 1 and set(columns["method"]) == {"harmonic balance 7", "sweep up"}


def test_matching_is_by_verdict_then_by_distance():
    pairs, left, more = matched([(S, 1.0), (U, 2.0), (S, 3.0)], [(S, 2.9), (S, 1.1), (U, 9.0)])
    assert pairs == [(0, 1), (1, 2), (2, 0)] and left == [] and more == []
    pairs, left, more = matched([(S, 1.0), (U, 2.0), (S, 3.0)], [(S, 2.9)])
    assert pairs == [(2, 0)] and left == [0, 1] and more == []
    pairs, left, more = matched([(S, 1.0)], [(U, 1.0)])
    assert pairs == [] and left == [0] and more == [0]
    pairs, left, more = matched([(N, 1.0), (U, 2.0)], [(S, 1.0), (U, 2.0)])
    assert pairs == [(0, 0), (1, 1)]


def test_matching_of_many_agrees_with_the_exhaustive_one():
    random = np.random.default_rng(2)
    one = [(S, float(v)) for v in random.normal(size=7)]
    order = random.permutation(7)
    other = [(S, one[i][1] + 1e-9) for i in order]
    pairs, _, _ = matched(one, other)
    assert all(order[j] == i for i, j in pairs) and len(pairs) == 7


def test_bad_input(results):
    full = results["full"]
    with pytest.raises(InputError, match="at least one"):
        st.compare(full)
    with pytest.raises(InputError, match="must be a Branch"):
        st.compare(results["up"], full)
    with pytest.raises(InputError, match="cannot compare"):
        st.compare(full, 3.0)
    with pytest.raises(UnknownNameError, match=r"w\.max"):
        st.compare(full, results["hb7"], quantity="w.max")
    other = st.continuation(st.Collocation(st.models.duffing(beta=0.0)), "xi", (0.02, 0.03))
    with pytest.raises(InputError, match="runs along xi"):
        st.compare(full, other)
