"""Automatic places of the blocks of a sheet, as a person draws a control loop.

The forward path runs in one row from the source to the sink, feedback runs below and is mirrored:

1. :mod:`loops`, :mod:`feedback`: loops are cut where a person would draw the line backwards, and blocks in
   feedback paths are mirrored.
2. :mod:`columns`: every block gets a column, and long lines get a knot in each column that they pass.
3. :mod:`order`: the order within the columns, with few crossings.
4. :mod:`rows`: heights, with straight lines where they can be.
5. :func:`arranged_boxes`: widths of the columns and of the gaps between them, and the parts of the sheet
   one below the other.

The method is that of Sugiyama, Tagawa and Toda, *Methods for visual understanding of hierarchical system
structures*, 1981, with lines that turn round as in Sander's *Graph layout through the VCG tool*, 1994.
"""

from armblocks.drawing.arrangement.arranged import arranged_boxes as arranged_boxes
