"""Floquet theory: monodromy, multipliers, verdicts, Mathieu and Hill numbers."""
