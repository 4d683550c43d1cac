"""Mechanisms drawn as blocks: from frame lines to a robot, and from a robot to blocks with equations."""
