"""``python -m armblocks``: the command line."""

from armblocks.cli.main import main

if __name__ == "__main__":
    main()
