"""The public Python face: what users type. ``armblocks`` exports what is here, each name when first used."""
