"""A small typed language for numeric routines, with back ends that write them as text."""
