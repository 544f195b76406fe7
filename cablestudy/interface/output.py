"""Tables and files as they leave the program: fitted to a terminal, in columns for other programs, written whole."""

from cablestudy.study.markdown import fitted
from cablestudy.study.parquet import write_parquet
from cablestudy.study.table import write_whole

__all__ = ["fitted", "write_parquet", "write_whole"]
