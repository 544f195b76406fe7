"""Parameter studies of actively controlled suspended cables."""

__version__ = "0.1.0"
