"""Readers of triangle meshes, one file each."""
