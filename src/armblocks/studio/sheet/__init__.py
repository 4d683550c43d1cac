"""Diagrams in the studio: edits, data of sheets, checks, search."""
