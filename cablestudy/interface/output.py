"""Tables as they leave the program: fitted to a terminal, and in columns for other programs."""

from cablestudy.study.markdown import fitted
from cablestudy.study.parquet import write_parquet

__all__ = ["fitted", "write_parquet"]
