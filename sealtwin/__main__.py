"""``python -m sealtwin``: the command, where the environment's scripts are not on the PATH."""

from sealtwin.cli import main

if __name__ == "__main__":
    main()
