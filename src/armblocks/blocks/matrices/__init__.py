"""Blocks of matrix algebra."""
