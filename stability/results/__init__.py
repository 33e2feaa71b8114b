"""Frozen data: what the verbs return. A result can be loaded and plotted without any solver."""
