"""Stability charts over two parameters, their boundary curves and tips, and linear response."""
