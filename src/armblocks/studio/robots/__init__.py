"""Robots in the studio: tables and edits of the robot editor, read-outs of an arm, scenes."""
