"""The part of scipy.sparse.csgraph that armblocks uses, typed."""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

def connected_components(
    csgraph: NDArray[Any], directed: bool, connection: Literal["weak", "strong"]
) -> tuple[int, NDArray[np.int32]]: ...
