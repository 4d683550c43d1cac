"""The compiled functions of an arm, by the names of their methods."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.compiler import Kernel, cached_kernel
from armblocks.compiler.arguments import check_count, in_order
from armblocks.errors import InputError
from armblocks.face.payload import Payload, payload_numbers
from armblocks.robot import Robot

if TYPE_CHECKING:
    from armblocks.equations import TracedFunction
    from armblocks.face.ikine_search import ArmSearch
    from armblocks.face.symbolic_arm import SymbolicArm

Array = NDArray[np.float64]
Maker = tuple[Callable[..., object], tuple[object, ...]]
"""A function and its arguments, as ``__reduce__`` returns them."""

_NO_WRENCH = np.zeros(6)
_NO_WRENCH.flags.writeable = False
_OPTIONS = ("wrench", "payload", "out", "threads")


class ArmKernels:
    """The kernels of a robot, compiled at first use; ``near``: as for :class:`armblocks.Arm`.

    ``maker``: the function and arguments by which pickled functions create their arm.
    """

    def __init__(
        self, robot: Robot, near: Array | None, maker: tuple[Callable[..., object], tuple[object, ...]]
    ) -> None:
        self.robot = robot
        self.near = near
        self._maker = maker
        self._kernels: dict[str, Kernel] = {}
        self._searches: dict[tuple[str | None, str], ArmSearch] = {}

    @cached_property
    def description_key(self) -> str:
        """The content on which the equations depend: the robot without its appearance and source file."""
        links = tuple(replace(link, geometry=None) for link in self.robot.links)
        return hashlib.sha256(repr(replace(self.robot, links=links, source="")).encode()).hexdigest()

    @cached_property
    def symbolic(self) -> SymbolicArm:
        """The equations in symbols, cached because each object of this class has its own symbols."""
        from armblocks.face.symbolic_arm import SymbolicArm

        return SymbolicArm(self.robot)

    def kernel(self, method: str) -> Kernel:
        """The kernel of a method, such as ``"fkine"`` or ``"rne_loaded"``."""
        kernel = self._kernels.get(method)
        if kernel is None:
            key, options = f"robot/{method}/{self.description_key}", {}
            if self.near is not None and method in _assembled():
                key, options = f"{key}/near {self.near.tolist()}", {"near": self.near}
            kernel = cached_kernel(key, lambda: traces()[method](self.robot, **options))
            self._kernels[method] = kernel
        return kernel

    def entry(self, method: str) -> Callable[..., Array]:
        """The native function of a method; pickling stores the robot and the name of the method."""
        kernel = self.kernel(method)
        return kernel.entry_with_fallback(kernel.__call__, maker=self._maker)

    def framed(self, method: str) -> Callable[..., Array]:
        """A function that calls the kernel of a method for the tool, or for another frame of the robot."""
        kernel = self.kernel(method)

        def call(
            *arguments: ArrayLike,
            frame: str | None = None,
            out: Array | None = None,
            threads: int = 1,
            **named: ArrayLike,
        ) -> Array:
            of_frame = kernel if frame is None else self.kernel_at(method, frame)
            if named:
                arguments = in_order(method, kernel.inputs, arguments, named, ("frame", "out", "threads"))
            return (of_frame.entry if named or frame else of_frame)(*arguments, out=out, threads=threads)

        return kernel.entry_with_fallback(call, maker=self._maker)

    def kernel_at(self, method: str, frame: str) -> Kernel:
        """The kernel of a method for a frame of the robot. Raises UnknownNameError."""
        name = f"{method} of {frame}"
        kernel = self._kernels.get(name)
        if kernel is None:
            self.robot.frame(frame)
            key = f"robot/{name}/{self.description_key}"
            kernel = cached_kernel(key, lambda: traces()[method](self.robot, frame))
            self._kernels[name] = kernel
        return kernel

    def search(self, frame: str | None, axes: str) -> ArmSearch:
        """The compiled inverse kinematics of the tool or of a frame. Raises UnknownNameError."""
        search = self._searches.get((frame, axes))
        if search is None:
            from armblocks.face.ikine_search import ArmSearch

            name = f"pose_error_in_{axes}"
            error = self.kernel(name) if frame is None else self.kernel_at(name, frame)
            fkine = self.kernel("fkine") if frame is None else self.kernel_at("fkine", frame)
            search = ArmSearch(self.robot, error, fkine, self.kernel("integrate"))
            self._searches[frame, axes] = search
        return search

    def loaded(self, method: str) -> Callable[..., Array]:
        """A function that calls the kernel of a method, or a second kernel if a wrench or payload is given.

        The second kernel is compiled at its first use.
        """
        kernel = self.kernel(method)

        @cache
        def with_loads() -> Callable[..., Array]:
            return self.kernel(f"{method}_loaded").entry

        def call(
            *arguments: ArrayLike,
            wrench: ArrayLike | None = None,
            payload: Payload | ArrayLike | None = None,
            out: Array | None = None,
            threads: int = 1,
            **named: ArrayLike,
        ) -> Array:
            if named:
                arguments = in_order(method, kernel.inputs, arguments, named, _OPTIONS)
            if wrench is None and payload is None:
                return (kernel.entry if named else kernel)(*arguments, out=out, threads=threads)
            force = _NO_WRENCH if wrench is None else wrench
            payload_values = payload.numbers if isinstance(payload, Payload) else payload_numbers(payload)
            try:
                return with_loads()(*arguments, force, payload_values, out=out, threads=threads)
            except InputError:
                check_count(
                    method, kernel.inputs, arguments
                )  # the message is about positional arguments only
                raise

        return kernel.entry_with_fallback(call, maker=self._maker)


def _assembled() -> Sequence[str]:
    """The methods whose equations depend on an assembled configuration of the robot."""
    from armblocks.dynamics.traces import ASSEMBLED

    return ASSEMBLED


def traces() -> Mapping[str, Callable[..., TracedFunction]]:
    """All traced quantities; imported here, because code from the disk cache needs no tracing."""
    from armblocks.dynamics import TRACES

    return TRACES
