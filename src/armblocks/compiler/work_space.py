"""Temporary memory of a function body: from the stack, or from the C library if it is large.

Stacks are short: 8 MiB in the first thread of a process, 512 KiB in others on some systems. Linear equations
in 300 unknowns over eight lanes need 12 MB.
"""

from __future__ import annotations

from armblocks.compiler.ir_text import Body

MAX_STACK_BYTES = 128 * 1024
"""Maximum number of bytes of a work space on the stack."""


class WorkSpace:
    """Rows of one double for each lane of a body, aligned to the size of a row; not initialised.

    The memory must be freed in the same body. ``address``: the address of the first row.
    """

    def __init__(self, body: Body, rows: int) -> None:
        self._body = body
        self._align = 8 * body.lanes
        size = self._align * max(1, rows)
        self._on_stack = size <= MAX_STACK_BYTES
        # The value that releases the memory: the top of the stack, or the address from the C library.
        self._mark, self.address = self._from_stack(size) if self._on_stack else self._from_heap(size)

    def row(self, index: int) -> str:
        """The address of a row."""
        body = self._body
        return body.let(f"getelementptr inbounds {body.real}, ptr {self.address}, i64 {index}")

    def read(self, index: int) -> str:
        """The numbers of a row."""
        return self._body.let(f"load {self._body.real}, ptr {self.row(index)}, align {self._align}")

    def write(self, index: int, value: str) -> None:
        """Set the numbers of a row."""
        self._body.do(f"store {self._body.real} {value}, ptr {self.row(index)}, align {self._align}")

    def free(self) -> None:
        """Release the memory."""
        release = "llvm.stackrestore.p0" if self._on_stack else "free"
        self._body.module.declare("void", release, "ptr")
        self._body.do(f"call void @{release}(ptr {self._mark})")

    def _from_stack(self, size: int) -> tuple[str, str]:
        body = self._body
        body.module.declare("ptr", "llvm.stacksave.p0")
        top = body.let("call ptr @llvm.stacksave.p0()")
        return top, body.let(f"alloca double, i64 {size // 8}, align {self._align}")

    def _from_heap(self, size: int) -> tuple[str, str]:
        body = self._body
        body.module.declare("ptr", "malloc", "i64")
        body.module.declare("ptr", "llvm.ptrmask.p0.i64", "ptr", "i64")
        memory = body.let(f"call ptr @malloc(i64 {size + self._align - 8})")
        # The C library aligns to at least 8 bytes.
        aligned_end = body.let(f"getelementptr inbounds i8, ptr {memory}, i64 {self._align - 8}")
        return memory, body.let(f"call ptr @llvm.ptrmask.p0.i64(ptr {aligned_end}, i64 {-self._align})")
