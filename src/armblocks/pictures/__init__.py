"""Pictures: marks with theme colours (tones), written as SVG, PNG or PDF; formatting of numbers and texts."""
