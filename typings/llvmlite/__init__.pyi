"""The part of llvmlite that armblocks uses, typed."""

__version__: str
