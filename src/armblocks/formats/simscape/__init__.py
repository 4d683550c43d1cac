"""Robots from the CAD exports of Simscape Multibody: import XML, and data files of imported models."""
