"""Many runs of one compiled system: designs, measures, the native loop over runs, tables of results."""
