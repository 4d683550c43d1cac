"""The processor for which code is compiled: name, features, number of lanes of a vector register."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from llvmlite import binding as llvm

_LOCK = threading.Lock()


@dataclass(frozen=True, kw_only=True)
class Target:
    """The properties of a processor for the code generator, all part of the key of cached code."""

    triple: str
    cpu: str
    features: str
    lanes: int
    """Doubles in one vector register."""
    llvm_version: str

    @property
    def key(self) -> str:
        """The text that identifies the target; code for this key runs on all machines with the same key."""
        return "|".join((self.triple, self.cpu, self.features, str(self.lanes), self.llvm_version))

    def machine(self, *, jit: bool = True, opt: int = 2) -> llvm.TargetMachine:
        """A new LLVM target machine; ``opt`` is LLVM's optimisation level, 0 to 2."""
        from llvmlite import binding as llvm

        return llvm.Target.from_triple(self.triple).create_target_machine(
            cpu=self.cpu,
            features=self.features,
            opt=opt,
            reloc="pic",
            codemodel="jitdefault" if jit else "default",
            jit=jit,
        )


@cache
def host_target() -> Target:
    """The processor of this machine. Initialises LLVM at the first use."""
    import llvmlite
    from llvmlite import binding as llvm

    with _LOCK:
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
    triple, features = llvm.get_process_triple(), llvm.get_host_cpu_features()
    return Target(
        triple=triple,
        cpu=llvm.get_host_cpu_name(),
        features=target_features(triple, features.flatten()),
        lanes=vector_lanes(triple, features),
        llvm_version=f"llvmlite {llvmlite.__version__}, LLVM {'.'.join(map(str, llvm.llvm_version_info))}",
    )


def target_features(triple: str, features: str) -> str:
    """LLVM's list of features for a processor with ``features`` (``"+avx2,-sve"``).

    On some x86-64 processors LLVM uses only half of a 512-bit register unless ``prefer-256-bit`` is switched
    off. Other architectures do not have this feature.
    """
    return ",".join(part for part in (features, "-prefer-256-bit" if _is_x86_64(triple) else "") if part)


def _is_x86_64(triple: str) -> bool:
    return triple.startswith(("x86_64", "amd64"))


def vector_lanes(triple: str, features: dict[str, bool]) -> int:
    """Doubles in the widest vector register that has a fused multiply-add, by the processor's features."""
    if _is_x86_64(triple):
        if features.get("avx512f"):
            return 8
        return 4 if features.get("avx2") and features.get("fma") else 2
    return 2
