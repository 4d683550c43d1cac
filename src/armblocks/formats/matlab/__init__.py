"""A safe interpreter of the MATLAB subset for straight-line robot scripts.

``source`` (lines and places) → ``page_layout`` → ``lexer`` → ``parser`` (``syntax``) → ``interpreter``
(``values``, ``functions``, ``records`` and the toolbox's objects). Nothing is evaluated by Python, and
unsupported code is a ``FormatError`` with file, line and text.
"""
