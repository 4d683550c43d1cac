"""Diagrams in the studio: edits, what a sheet shows, checks, search."""
