"""The part of pyarrow.parquet that armblocks uses, typed."""

from typing import BinaryIO

from pyarrow import Table

def write_table(table: Table, where: BinaryIO | str) -> None: ...
def read_table(source: BinaryIO | str) -> Table: ...
