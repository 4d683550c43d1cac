"""Pictures: marks whose colours are tones, written as SVG, PNG or PDF, and how numbers and texts look."""
