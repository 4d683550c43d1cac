"""Automatic positions of the blocks of a sheet, in the conventional form of a control loop.

The forward path is one row from the source to the sink. The feedback path is below it, with mirrored blocks:

1. :mod:`loops`, :mod:`feedback`: every loop is cut at the connections that are drawn backwards, and blocks in
   feedback paths are mirrored.
2. :mod:`columns`: every block gets a column, and a long line gets a dummy node in each column that it
   passes.
3. :mod:`order`: the order of the nodes within each column, with few crossings.
4. :mod:`rows`: heights of the nodes, with as many straight lines as possible.
5. :func:`arranged_boxes`: widths of the columns and of the gaps between them; connected parts of the
   sheet are placed one below the other.

Source: Sugiyama, Tagawa and Toda, *Methods for visual understanding of hierarchical system
structures*, 1981, with lines that reverse their direction as in Sander's *Graph layout
through the VCG tool*, 1994.
"""

from armblocks.drawing.arrangement.boxes import arranged_boxes as arranged_boxes
