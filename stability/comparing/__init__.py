"""Laying methods over each other: the same question, several answers, their differences in numbers."""
