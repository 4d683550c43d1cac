"""The part of pyarrow.csv that armblocks uses, typed."""

from typing import BinaryIO

from pyarrow import Table

class WriteOptions:
    def __init__(self, include_header: bool | None = None) -> None: ...

def write_csv(data: Table, output_file: BinaryIO, write_options: WriteOptions | None = None) -> None: ...
