"""``python -m boulder_sweep``: the command ``sweep`` where it is not on the path."""

from boulder_sweep.cli.main import main

if __name__ == "__main__":
    main()
