"""Robots from MJCF, the model files of MuJoCo."""
