"""The part of scipy.io that armblocks uses, typed."""

from collections.abc import Mapping
from typing import Any, BinaryIO, Literal

def savemat(
    file_name: str | BinaryIO,
    mdict: Mapping[str, Any],
    *,
    long_field_names: bool = ...,
    oned_as: Literal["row", "column"] = ...,
) -> None: ...
def loadmat(file_name: Any) -> dict[str, Any]: ...
