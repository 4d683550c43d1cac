"""The command line: ``armblocks run | show | list | bench``. The only place that knows typer and rich."""
