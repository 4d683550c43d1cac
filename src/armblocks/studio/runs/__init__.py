"""Runs in the studio: one process each, what it has said, pace, history, settings, reports."""
