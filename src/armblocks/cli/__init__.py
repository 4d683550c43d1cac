"""The command line: ``armblocks run | show | list | bench …``. Only this package imports typer and rich."""
