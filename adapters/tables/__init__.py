"""Tables of numbers over time, CSV or Parquet: played back into a run, and written from one."""

from adapters.tables.sink import TableSink
from adapters.tables.source import TableSource

__all__ = ["TableSink", "TableSource"]
