"""What the reference pages hold that is made from the code: commands, entries, columns, equations, docstrings."""

from __future__ import annotations

from pathlib import Path

import click

import boulder_kernels
import boulder_sweep
from boulder_sweep.cli.main import cli
from docs.site.settings_tables import choices_table, columns_table, entries_table, equations_table, flags_table

EQUATIONS = Path(__file__).parents[1] / "equations.tsv"


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


def all_entries() -> str:
    """Return the entries of a settings file: those that may be axes, and those that hold for a whole file."""
    return f"{entries_table().markdown()}\n\n{choices_table().markdown()}\n"


def flags_and_columns() -> str:
    """Return the flags of `validity`, and the outcomes of a result."""
    return f"{flags_table().markdown()}\n\n## Outcomes\n\n{columns_table().markdown()}\n"


def register() -> str:
    """Return the register of equations."""
    return f"{equations_table(EQUATIONS.read_text(encoding='utf-8')).markdown()}\n"


def public_names() -> str:
    """Return the public names of `boulder_sweep`, for mkdocstrings to fill in."""
    found = []
    for name in boulder_sweep.__all__:
        value = getattr(boulder_sweep, name)
        if not name.startswith("_"):
            found.append(f"::: {value.__module__}.{value.__qualname__}")
    return "\n\n".join(found) + "\n"


def kernel_page() -> str:
    """Return a page of all modules of `boulder_kernels`, for mkdocstrings to fill in."""
    from pkgutil import iter_modules

    names = sorted(module.name for module in iter_modules(boulder_kernels.__path__) if not module.name.startswith("_"))
    intro = (
        "Plain numbers in SI, the paper's symbols. The [register](../model.md#register-of-equations) maps equations."
    )
    return "\n\n".join(["# Kernels", intro, *(f"::: boulder_kernels.{name}" for name in names)]) + "\n"
