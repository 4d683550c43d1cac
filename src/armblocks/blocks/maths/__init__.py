"""Blocks without memory: outputs are functions of the present inputs."""
