"""The command ``sweep``, also as ``python -m boulder_sweep``; it notes signals before it imports anything heavy."""

from __future__ import annotations

from typing import NoReturn

from boulder_sweep.signals import install


def main() -> NoReturn:
    """Run the command line and end the process with its exit code."""
    install()
    from boulder_sweep.cli.main import main as run

    run()


if __name__ == "__main__":
    main()
