"""`responses`: several methods over one system. Witness: each method called by itself, folds of ten digits, planted errors."""

import warnings

import numpy as np
import pytest

import stability as st
from stability.errors import FileFormatError, InputError, StabilityError, UnknownNameError

METHODS = ("averaging", "averaging2", "hb3", "hb7", "collocation", "shooting", "sweep")


@pytest.fixture(scope="module")
def duffing():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", st.errors.StabilityWarning)
        return st.responses(st.models.duffing(xi=0.02, beta=0.001), "Omega", (0.3, 3.0), METHODS, points=41)


def test_each_method_is_what_it_is_alone(duffing):
    """Folds of each method: those of `continuation` on its own; truth 1.088436639, 1.380933030."""
    system = st.models.duffing(xi=0.02, beta=0.001)
    problems = {
        "averaging": st.Equilibrium(st.averaging(system)),
        "averaging2": st.Equilibrium(st.averaging(system, order=2)),
        "hb7": st.HarmonicBalance(system, harmonics=7),
        "shooting": st.Shooting(system),
    }
    rows = {row["method"]: row for row in duffing.rows()}
    assert list(duffing) == ["collocation", "averaging", "averaging2", "hb3", "hb7", "shooting", "sweep-up", "sweep-down"]
    assert rows["collocation"]["folds"] == pytest.approx([1.088436639, 1.380933030], abs=2e-9)
    for name, problem in problems.items():
        alone = st.continuation(problem, "Omega", (0.3, 3.0))
        assert rows[name]["folds"] == pytest.approx(sorted(p.params["Omega"] for p in alone.special), abs=1e-10)
    assert rows["hb7"]["largest_error"] < 1e-9 and max(map(abs, rows["hb7"]["fold_errors"])) < 1e-9
    # the second order is closer than the first, three harmonics closer than both
    errors = [rows[name]["largest_error"] for name in ("averaging", "averaging2", "hb3", "hb7")]
    assert errors == sorted(errors, reverse=True)
    assert rows["averaging"]["missing"] == duffing.comparison["averaging"].missing.__len__()


def test_comparison_is_that_of_compare(duffing):
    """The same numbers from `compare` on the branches."""
    by_hand = st.compare(duffing["collocation"], duffing["averaging"], duffing["sweep-up"], points=41)
    for name, other in (("averaging", "averaging"), ("sweep-up", "sweep up")):
        assert np.array_equal(duffing.comparison[name].errors, by_hand[other].errors)


def test_jumps_of_the_sweeps_are_at_the_folds(duffing):
    (up,), (down,) = duffing["sweep-up"].jumps, duffing["sweep-down"].jumps
    assert up.parameter == pytest.approx(1.38093, abs=2e-3) and down.parameter == pytest.approx(1.08844, abs=2e-3)


def test_table_names_every_method_once(duffing):
    text = duffing.table()
    assert all(sum(line.split()[:1] == [name] for line in text.splitlines()) == 1 for name in duffing)
    assert "1.38093303" in text and "against" not in repr(duffing)


def test_extrema_of_a_slow_flow_are_those_of_its_motion():
    """u.max of the averaged motion: the reconstruction on a fine grid; with hard forcing it is not the amplitude."""
    system = st.models.duffing_textbook(delta=0.02, beta=0.2, gamma=0.3)
    found = st.responses(system, "omega", (0.5, 0.7), ("averaging2", "collocation"), quantity="x.max", points=3)
    slow = st.averaging(system, order=2)
    (branch,) = found["averaging2"]
    point = branch.solution(0)
    motion = st.reconstruct(slow, point, np.linspace(0, 2 * np.pi / branch.parameter[0], 20001))
    assert branch.columns["x.max"][0] == pytest.approx(motion[0].max(), rel=1e-8)
    assert branch.columns["x.max"][0] != pytest.approx(branch.columns["x_amplitude"][0], rel=1e-3)
    assert found.comparison["averaging2"].worst < 5e-3


def test_open_resonance_has_branches_from_both_ends():
    """beta = 0.05 > 16 xi^2/3: the rising branch has no fold, the detached one, from above, has one at 1.416368134."""
    found = st.responses(st.models.duffing(xi=0.02, beta=0.05), "Omega", (0.3, 3.0), ("hb9", "collocation"), points=11)
    assert [len(found[name]) for name in ("hb9", "collocation")] == [2, 2]
    (row,) = [row for row in found.rows() if row["method"] == "collocation"]
    assert row["folds"] == pytest.approx([1.416368134], abs=2e-9)
    assert not found.comparison["hb9"].missing and not found.comparison["hb9"].extra


def test_born_branches_of_the_pendulum():
    """Rest and swing by averaging and by harmonic balance: folds, branch points beside period doublings, torus points."""
    found = st.responses(
        st.models.autoparametric_pendulum(), "Omega", (0.88, 1.1), ("averaging", "hb5"), resonance=(2, 1), born=True,
        quantity="theta.max", points=5,
    )  # fmt: skip
    slow, full = ({kind: [p for k, p in row["others"] if k == kind] for kind, _ in row["others"]} | {"folds": row["folds"]}
                  for row in sorted(found.rows(), key=lambda row: row["method"]))  # fmt: skip
    assert full["Neimark-Sacker"] == pytest.approx([0.984873538, 0.999884193], abs=1e-8)
    assert slow["Hopf"] == pytest.approx(full["Neimark-Sacker"], abs=4e-4)
    assert slow["branch point"] == pytest.approx(full["period doubling"], abs=2e-4)
    assert len(slow["folds"]) == len(full["folds"]) == 2
    assert len(found["averaging"]) == len(found["hb5"]) == 2
    # both mirror images of the slow flow are one motion: nothing is counted twice
    assert not found.comparison["averaging"].missing and len(found.comparison["averaging"].extra) <= 1


def test_a_method_that_fails_leaves_the_others():
    """A cubic spring of order 0: averaging refuses by name, harmonic balance and collocation are there."""
    system = st.models.duffing_textbook(beta=0.1).replace(orders={})
    found = st.responses(system, "omega", (0.5, 0.8), ("averaging", "hb5", "collocation"), points=3)
    assert list(found) == ["collocation", "hb5"] and list(found.failures) == ["averaging"]
    assert "small=" in str(found.failures["averaging"]) and "failed: " in found.table()
    with pytest.raises(InputError, match="scaling orders"):
        found["averaging"]
    with pytest.raises(UnknownNameError, match="did you mean 'hb5'"):
        found["hb6"]


def test_a_quantity_that_only_some_have():
    """x.mean is a column of no method: every failure says so, and nothing is lost by an exception."""
    found = st.responses(st.models.duffing(), "Omega", (0.5, 0.8), ("averaging", "collocation"), quantity="u_absolute.max", points=3)
    assert list(found) == ["collocation"] and "u_absolute.max" in str(found.failures["averaging"])


def test_sweeps_alone_and_one_method_alone():
    system = st.models.duffing()
    alone = st.responses(system, "Omega", (0.5, 0.8), "sweep-up", step=0.1)
    assert alone.comparison.reference == "" and "no jump" in alone.table()
    one = st.responses(system, "Omega", (0.5, 0.8), ["hb3"])
    assert one.comparison.reference == "hb3" and not one.comparison.differences


def test_stored_and_read_again(duffing, tmp_path):
    import matplotlib.pyplot as plt

    duffing.save(tmp_path / "r.npz")
    again = st.load(tmp_path / "r.npz")
    assert again.table() == duffing.table() and list(again) == list(duffing)
    assert all(np.array_equal(a, b) for a, b in zip(again.to_dict().values(), duffing.to_dict().values()))
    figure, axes = plt.subplots()
    assert again.plot(ax=axes) and {t.get_text() for t in axes.get_legend().get_texts()} == set(duffing)
    plt.close(figure)
    (tmp_path / "bad.npz").write_bytes((tmp_path / "r.npz").read_bytes()[:2000])
    with pytest.raises(FileFormatError):
        st.load(tmp_path / "bad.npz")


def test_a_measurement_beside_the_methods(tmp_path):
    """Points planted on the collocation branch, 1 % too high: that is the error that the table shows, stored and read."""
    system = st.models.duffing.from_physical()
    branch = st.continuation(st.Collocation(system), "frequency", (24, 26))
    places = np.array([24.25, 25.0, 25.75])
    tops = np.array([max(o.amplitude(1)["y"] for o in branch.at(frequency=f)) for f in places])
    seen = st.MeasuredResponse("frequency", places, {"y.amplitude": 1.01 * tops})
    found = st.responses(system, "frequency", (24, 26), ("hb5", "collocation"), measured=seen, points=3)
    errors = found.comparison["measured"].errors
    assert errors == pytest.approx(0.01 * tops / tops.max(), rel=1e-6)
    found.save(tmp_path / "r.npz")
    again = st.load(tmp_path / "r.npz")
    assert again.table() == found.table() and "3 points" in again.table()
    assert np.array_equal(again["measured"].parameter, places)
    other = st.MeasuredResponse("Omega", places, {"y.amplitude": tops})
    failed = st.responses(system, "frequency", (24, 26), ("collocation",), measured=other, points=3).failures
    assert "runs along Omega" in str(failed["measured"])


def test_families_are_compared_as_they_are_returned():
    """Two families of an open resonance by two methods: three solutions above the fold of the lower family in both."""
    system = st.models.duffing(xi=0.02, beta=0.05)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", st.errors.StabilityWarning)
        both = [st.families(p, "Omega", (1.0, 2.0), places=0) for p in (st.Collocation(system), st.HarmonicBalance(system, harmonics=11))]
    difference = st.compare(*both, points=5)["harmonic balance 11"]
    assert difference.parameter.size == 1 * 2 + 3 * 3 and not difference.missing and not difference.extra
    assert difference.worst < 1e-6 and difference.folds[0][0] == pytest.approx(1.416368134, abs=2e-9)


CASES = {
    "autonomous": (lambda: st.responses(st.models.van_der_pol(), "mu", (0.1, 1)), InputError, "autonomous.*Collocation"),
    "parameter": (lambda: st.responses(st.models.duffing(), "omega", (0.3, 3)), UnknownNameError, "did you mean 'Omega'"),
    "window": (lambda: st.responses(st.models.duffing(), "Omega", (3, 0.3)), InputError, "from < to"),
    "bounds": (lambda: st.responses(st.models.duffing(), "Omega", (-1, 0.3)), InputError, "outside its bounds"),
    "no window": (lambda: st.responses(st.models.duffing(), "Omega", 3), InputError, "two numbers"),
    "no method": (lambda: st.responses(st.models.duffing(), "Omega", (0.3, 3), ()), InputError, "at least one method"),
    "unknown": (lambda: st.responses(st.models.duffing(), "Omega", (0.3, 3), ("colocation",)), UnknownNameError, "did you mean 'collocation'"),
    "no harmonics": (lambda: st.responses(st.models.duffing(), "Omega", (0.3, 3), ("hb0",)), UnknownNameError, "hb0"),
    "template": (lambda: st.responses(st.models.duffing(), "Omega", (0.3, 3), ("hb<harmonics>",)), UnknownNameError, "hb<"),
    "twice": (lambda: st.responses(st.models.duffing(), "Omega", (0.3, 3), ("sweep", "sweep-up")), InputError, "sweep-up is given twice"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_mistakes_before_any_work(name):
    call, error, pattern = CASES[name]
    with pytest.raises(error, match=pattern):
        call()
    assert issubclass(error, StabilityError)
