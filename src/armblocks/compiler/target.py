"""The processor that code is made for: its name, its features, how many lanes its registers hold."""

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
    """What the code generator must know of a processor. All parts belong to the key of cached code."""

    triple: str
    cpu: str
    features: str
    lanes: int
    """Doubles in one vector register."""
    llvm_version: str

    @property
    def key(self) -> str:
        """Identifies the target: code made for one key runs wherever the key is the same."""
        return "|".join((self.triple, self.cpu, self.features, str(self.lanes), self.llvm_version))

    def machine(self, *, jit: bool = True, opt: int = 2) -> llvm.TargetMachine:
        """A new LLVM target machine; ``opt``: how much work goes into the code, 0 to 2."""
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
    """The processor that we run on. Starts LLVM on first use."""
    import llvmlite
    from llvmlite import binding as llvm

    with _LOCK:
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
    features = llvm.get_host_cpu_features()
    return Target(
        triple=llvm.get_process_triple(),
        cpu=llvm.get_host_cpu_name(),
        # LLVM keeps to half of a 512-bit register on some processors unless told so.
        features=",".join(part for part in (features.flatten(), "-prefer-256-bit") if part),
        lanes=vector_lanes(llvm.get_process_triple(), features),
        llvm_version=f"llvmlite {llvmlite.__version__}, LLVM {'.'.join(map(str, llvm.llvm_version_info))}",
    )


def vector_lanes(triple: str, features: dict[str, bool]) -> int:
    """Doubles in the widest vector register that has a fused multiply-add, by the processor's features."""
    if triple.startswith(("x86_64", "amd64")):
        if features.get("avx512f"):
            return 8
        return 4 if features.get("avx2") and features.get("fma") else 2
    return 2
