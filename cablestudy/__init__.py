"""Parameter studies of actively controlled suspended cables."""

__version__ = "0.2.0"
