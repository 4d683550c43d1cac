"""Robots in the studio: the editor's tables, edits, readings, scenes."""
