"""`stability average`: its text, LaTeX and JSON against the library's own slow flow, and what it refuses."""

from __future__ import annotations

import json

import pytest

import stability as st
from stability.cli import main


def run(capsys, *arguments):
    code = main(list(arguments))
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_latex_is_that_of_the_system(capsys):
    code, out, _ = run(capsys, "average", "autoparametric_pendulum", "--resonance", "2:1", "--latex")
    assert code == 0
    assert out.strip() == st.averaging(st.models.autoparametric_pendulum(), resonance=(2, 1)).latex()


@pytest.mark.parametrize("method", ["averaging", "multiple-scales"])
def test_json_holds_the_equations(capsys, method):
    options = ["--set", "beta=0.2", "--order", "2", "--variables", "polar", "--method", method]
    code, out, _ = run(capsys, "average", "duffing_textbook", *options, "--json")
    verb = st.averaging if method == "averaging" else st.multiple_scales
    slow = verb(st.models.duffing_textbook(beta=0.2), order=2, variables="polar")
    document = json.loads(out)
    assert code == 0
    assert document["equations"] == {s: str(e) for s, e in zip(slow.states, slow.rhs)}
    assert document["latex"] == slow.latex() and set(document["reconstruction"]) == {"x", "x_dot"}


def test_text_and_own_orders(capsys):
    small = ["--small", "damping", "--small", "cubic=1", "--small", "acceleration"]
    code, out, _ = run(capsys, "average", "duffing.from_physical", *small)
    assert code == 0
    assert "y_cos'" in out and "y_amplitude" in out and "averaging 1:1, order 1" in out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("lorenz",), "first order"),
        (("duffing", "--resonance", "2:1"), "no resonance 2:1"),
        (("duffing", "--resonance", "2"), "for example 2:1"),
        (("duffing", "--resonance", "0:1"), "for example 2:1"),
        (("duffing", "--small", "xi=a"), "must be an integer"),
        (("duffing", "--small", "xj"), "did you mean 'xi'"),
        (("duffing", "--order", "3"), "1<=x<=2"),
    ],
)
def test_bad_input_is_one_sentence_and_code_2(capsys, arguments, sentence):
    code, _, err = run(capsys, "average", *arguments)
    assert code == 2
    assert sentence in err and "Traceback" not in err
