"""The public Python interface: ``armblocks`` exports the names of this package, each at first use."""
