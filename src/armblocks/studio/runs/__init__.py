"""Runs in the studio: processes, records, pace, history, settings, reports."""
