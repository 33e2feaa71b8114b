"""Following curves: the one continuation driver."""
