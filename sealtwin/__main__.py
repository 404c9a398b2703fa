"""The command as ``python -m sealtwin``, if the environment's scripts are not on the PATH."""

from sealtwin.cli.app import main

if __name__ == "__main__":
    main()
