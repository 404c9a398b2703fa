"""Command as ``python -m sealtwin``, for an environment whose scripts are not on the PATH."""

from sealtwin.cli.app import main

if __name__ == "__main__":
    main()
