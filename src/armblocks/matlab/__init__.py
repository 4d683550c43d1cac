"""The MATLAB-like language of robot scripts, formulas of masks and blocks, and values typed in the studio.

``source`` (lines and locations) → ``lexer`` → ``parser`` with the table of ``operators`` → ``syntax`` (the
tree; ``spelling`` writes it as text). ``evaluation`` evaluates the tree with the arithmetic of ``numbers`` or
of CasADi's ``symbols``. ``functions`` is the table of all functions. ``formula`` is the interface of
diagrams; ``armblocks.formats.matlab`` adds the statements of scripts, links and robots. Nothing is evaluated
by Python."""
