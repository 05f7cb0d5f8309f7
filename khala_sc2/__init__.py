"""The front door: the command line, and the one place that knows how all parts fit together on one machine."""

__version__ = "0.1.0"
