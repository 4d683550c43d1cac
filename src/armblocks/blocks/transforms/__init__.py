"""Blocks that compute with poses, rotations, quaternions and twists."""
