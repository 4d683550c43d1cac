"""A small typed language for numeric routines, with back ends that turn them into text."""
