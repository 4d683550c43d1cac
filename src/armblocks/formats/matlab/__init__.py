"""A safe interpreter of the MATLAB that straight-line robot scripts are written in.

``source`` (lines and places) → ``page_layout`` → ``lexer`` → ``parser`` (``syntax``) → ``interpreter``
(``values``, ``functions``, ``records`` and the toolbox's objects). Nothing is ever evaluated by Python, and
what is not understood is a ``FormatError`` with file, line and text.
"""
