"""The version: read by the build, the command line and stored results."""

__version__ = "0.1.0"
