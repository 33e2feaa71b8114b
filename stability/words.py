"""The field's words as enumerations: verdicts, kinds of special points, ways in which a branch ends.

A linear system with periodic coefficients is stable when its Floquet multipliers mu lie inside the unit circle. A
multiplier leaves at mu = +1 (fold, branch point), at mu = -1 (period doubling) or as a complex pair (Neimark-Sacker).
The members are strings, so that they print, compare, sort and serialise as the words they are.
"""

from __future__ import annotations

from enum import StrEnum

__all__ = ["Criticality", "Crossing", "Kind", "Status", "Verdict"]


class Verdict(StrEnum):
    """What is known about the stability of a solution; a guess is never among the answers.

    ``NEUTRAL`` is given only where structure proves it (undamped Hill, reversible, conservative);
    ``UNDETERMINED`` where the estimated error is larger than the distance to the stability limit.
    """

    STABLE = "stable"
    UNSTABLE = "unstable"
    NEUTRAL = "neutral"
    UNDETERMINED = "undetermined"


class Kind(StrEnum):
    """The kind of a special point on a branch (the value is the word, `label` the prefix used in plots)."""

    FOLD = "fold"
    BRANCH_POINT = "branch point"
    HOPF = "Hopf"
    PERIOD_DOUBLING = "period doubling"
    NEIMARK_SACKER = "Neimark-Sacker"
    GRAZING = "grazing"
    USER = "user"
    UNEXPLAINED = "unexplained"
    CUSP = "cusp"
    BOGDANOV_TAKENS = "Bogdanov-Takens"
    GENERALIZED_HOPF = "generalized Hopf"
    ZERO_HOPF = "zero-Hopf"
    DOUBLE_HOPF = "double Hopf"
    R1 = "resonance 1:1"
    R2 = "resonance 1:2"
    R3 = "resonance 1:3"
    R4 = "resonance 1:4"
    FOLD_FLIP = "fold-flip"
    GENERALIZED_PERIOD_DOUBLING = "generalized period doubling"
    CHENCINER = "Chenciner"
    EXTREMUM = "extremum"
    ISOLA_CENTRE = "isola centre"
    ISOLA_MERGER = "isola merger"

    @property
    def label(self) -> str:
        """The prefix of this kind's labels: ``LP`` in ``LP1``."""
        return _LABELS[self]


_LABELS = {
    Kind.FOLD: "LP",
    Kind.BRANCH_POINT: "BP",
    Kind.HOPF: "HB",
    Kind.PERIOD_DOUBLING: "PD",
    Kind.NEIMARK_SACKER: "NS",
    Kind.GRAZING: "GR",
    Kind.USER: "UZ",
    Kind.UNEXPLAINED: "XX",
    Kind.CUSP: "CP",
    Kind.BOGDANOV_TAKENS: "BT",
    Kind.GENERALIZED_HOPF: "GH",
    Kind.ZERO_HOPF: "ZH",
    Kind.DOUBLE_HOPF: "HH",
    Kind.R1: "R1_",
    Kind.R2: "R2_",
    Kind.R3: "R3_",
    Kind.R4: "R4_",
    Kind.FOLD_FLIP: "FF",
    Kind.GENERALIZED_PERIOD_DOUBLING: "GPD",
    Kind.CHENCINER: "CH",
    Kind.EXTREMUM: "EX",
    Kind.ISOLA_CENTRE: "IC",
    Kind.ISOLA_MERGER: "IM",
}


class Crossing(StrEnum):
    """Where the largest Floquet multiplier of an unstable solution left the unit circle."""

    PLUS_ONE = "+1"
    MINUS_ONE = "-1"
    PAIR = "pair"


class Criticality(StrEnum):
    """On which side of a special point the new solutions live, and whether they are dangerous."""

    SUPERCRITICAL = "supercritical"
    SUBCRITICAL = "subcritical"
    DEGENERATE = "degenerate"


class Status(StrEnum):
    """Why a branch ended; nothing that was computed is lost with any of them."""

    PARAMETER_BOUND = "parameter bound"
    CLOSED_LOOP = "closed loop"
    STEP_TOO_SMALL = "step too small"
    MAX_POINTS = "max points"
    STOPPED = "stopped"
    DIVERGED = "diverged"
