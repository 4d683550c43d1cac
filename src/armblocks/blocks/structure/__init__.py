"""Blocks that control conditional subsystems."""
