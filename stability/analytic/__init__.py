"""Perturbation methods and closed forms: averaging, multiple scales, transition curves, exact conservative motion."""
