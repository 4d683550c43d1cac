"""The types of the methods of ``Arm``: native functions, called with arrays of one sample or of a batch."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.face.payload import Payload

Array = NDArray[np.float64]


class ConfigurationFunction(Protocol):
    """``f(q)``: ``q`` (nq,) or (N, nq); one or N results. ``out`` receives the result."""

    def __call__(self, q: ArrayLike, *, out: Array | None = None, threads: int = 1) -> Array: ...


class FrameFunction(Protocol):
    """``f(q)`` of the tool, or of the frame with the name ``frame``."""

    def __call__(
        self, q: ArrayLike, *, frame: str | None = None, out: Array | None = None, threads: int = 1
    ) -> Array: ...


class SpeedFunction(Protocol):
    """``f(qd)``: ``qd`` (n,) or (N, n)."""

    def __call__(self, qd: ArrayLike, *, out: Array | None = None, threads: int = 1) -> Array: ...


class StateFunction(Protocol):
    """``f(q, qd)``: ``q`` (nq,) or (N, nq), ``qd`` (n,) or (N, n)."""

    def __call__(
        self, q: ArrayLike, qd: ArrayLike, *, out: Array | None = None, threads: int = 1
    ) -> Array: ...


class FramedStateFunction(Protocol):
    """``f(q, qd)`` of the tool, or of the frame with the name ``frame``."""

    def __call__(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        *,
        frame: str | None = None,
        out: Array | None = None,
        threads: int = 1,
    ) -> Array: ...


class IntegrateFunction(Protocol):
    """``f(q, qd, dt)``: ``q`` (nq,) or (N, nq), ``qd`` (n,) or (N, n), ``dt`` a number or (N,)."""

    def __call__(
        self, q: ArrayLike, qd: ArrayLike, dt: ArrayLike, *, out: Array | None = None, threads: int = 1
    ) -> Array: ...


class DifferenceFunction(Protocol):
    """``f(q0, q1)``: each (nq,) or (N, nq)."""

    def __call__(
        self, q0: ArrayLike, q1: ArrayLike, *, out: Array | None = None, threads: int = 1
    ) -> Array: ...


class MotionFunction(Protocol):
    """``f(q, qd, qdd)``, with an optional wrench (6,) or (N, 6) and payload."""

    def __call__(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        qdd: ArrayLike,
        *,
        wrench: ArrayLike | None = None,
        payload: Payload | ArrayLike | None = None,
        out: Array | None = None,
        threads: int = 1,
    ) -> Array: ...


class HybridFunction(Protocol):
    """``f(q, qd, tau, qdd)``, with an optional wrench (6,) or (N, 6) and payload; two results."""

    def __call__(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        tau: ArrayLike,
        qdd: ArrayLike,
        *,
        wrench: ArrayLike | None = None,
        payload: Payload | ArrayLike | None = None,
        out: tuple[Array, Array] | None = None,
        threads: int = 1,
    ) -> tuple[Array, Array]: ...


class DrivenStateFunction(Protocol):
    """``f(q, qd, tau)``, with an optional wrench (6,) or (N, 6) and payload."""

    def __call__(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        tau: ArrayLike,
        *,
        wrench: ArrayLike | None = None,
        payload: Payload | ArrayLike | None = None,
        out: Array | None = None,
        threads: int = 1,
    ) -> Array: ...
