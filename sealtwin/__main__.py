"""Run the command line with ``python -m sealtwin``, for example if the command is not on the PATH."""

from sealtwin.cli.app import main

if __name__ == "__main__":
    main()
