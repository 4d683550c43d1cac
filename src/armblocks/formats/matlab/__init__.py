"""Interpreter of the toolbox's robot scripts, with the lexer and parser of :mod:`armblocks.matlab`.

``script_text`` and ``page_layout`` (lines) → :mod:`armblocks.matlab` (statements) → ``interpreter``, with the
``script_values`` of expressions (``values``, ``records`` and the toolbox's objects). Nothing is evaluated by
Python, and unsupported code is a ``FormatError`` with file, line and text.
"""
