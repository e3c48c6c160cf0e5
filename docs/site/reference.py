"""Reference pages made from the code: commands from their help, Python and kernels from their docstrings."""

from __future__ import annotations

import click

import boulder_kernels
import boulder_sweep
from boulder_sweep.cli.main import cli


def command_help() -> str:
    """Return the help of every command, a section each."""
    parts = []
    with click.Context(cli, info_name="sweep", terminal_width=100) as context:
        for name in cli.list_commands(context):
            command = cli.get_command(context, name)
            assert command is not None
            with click.Context(command, info_name=name, parent=context, terminal_width=100) as inner:
                parts.append(f"## sweep {name}\n\n```text\n{command.get_help(inner)}\n```")
    return "\n\n".join(parts) + "\n"


def python_page() -> str:
    """Return a page of the public names of `boulder_sweep`, for mkdocstrings to fill in."""
    found = []
    for name in boulder_sweep.__all__:
        value = getattr(boulder_sweep, name)
        if not name.startswith("_"):
            found.append(f"::: {value.__module__}.{value.__qualname__}")
    return "\n\n".join(["# Python", "What `import boulder_sweep` offers.", *found]) + "\n"


def kernel_page() -> str:
    """Return a page of all modules of `boulder_kernels`, for mkdocstrings to fill in."""
    from pkgutil import iter_modules

    names = sorted(module.name for module in iter_modules(boulder_kernels.__path__) if not module.name.startswith("_"))
    intro = "Plain numbers in SI, the paper's symbols. The [register](../equations.md) says which equation is where."
    return "\n\n".join(["# Kernels", intro, *(f"::: boulder_kernels.{name}" for name in names)]) + "\n"
