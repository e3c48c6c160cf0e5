"""From a file to a checked sweep, with every mistake reported at once."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from boulder_sweep.settings import fields
from boulder_sweep.settings.leaf import Leaf
from boulder_sweep.settings.model import Criterion, Model, SolverSettings
from boulder_sweep.settings.overrides import apply_overrides
from boulder_sweep.settings.problems import Place, ProblemList, did_you_mean, shorten
from boulder_sweep.settings.schema import BLOCKS, CriterionBlock, ModelBlock, Section, SolverBlock
from boulder_sweep.settings.source import read_settings_text
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar
from boulder_sweep.settings.yaml_reader import parse

if TYPE_CHECKING:
    from boulder_sweep.settings.sweep import DesignList, Sweep

TOP_KEYS = ("name", *BLOCKS, "table")
MAX_DESIGNS = 2**63 - 1
"""Most designs of a sweep: ``design_id`` is a 64-bit number."""

_NAME = re.compile(r"\w[\w .+-]{0,79}")


def load(path: str | Path, overrides: Sequence[str] = ()) -> Sweep:
    """Read and check a file of settings.

    Parameters
    ----------
    path : str or Path
        YAML file.
    overrides : sequence of str
        ``key.path=value`` entries that replace those of the file, as of ``--set``.

    Returns
    -------
    Sweep
        Checked settings; grids are expanded only block by block.

    Raises
    ------
    SettingsError
        With every mistake of the file and of the overrides.
    """
    path = Path(path)
    return load_text(read_settings_text(path), path, overrides)


def load_text(text: str, path: Path, overrides: Sequence[str] = ()) -> Sweep:
    """Check the text of a file of settings; `path` names it in messages. Otherwise as `load`."""
    problems = ProblemList()
    root = parse(text, str(path), problems)
    if root is None:
        problems.raise_if_any()
        raise AssertionError("a text without keys is a problem")
    apply_overrides(root, overrides, problems)
    return _Loader(root, path, problems).sweep()


class _Loader:
    """The steps from a tree to a sweep; every step goes on after a mistake."""

    def __init__(self, root: Mapping, path: Path, problems: ProblemList) -> None:
        self.root = root
        self.path = path
        self.problems = problems
        self.leaves: dict[str, Leaf] = {}
        self.given: set[str] = set()
        self.blocks: dict[str, Section] = {}
        self.table: DesignList | None = None

    def sweep(self) -> Sweep:
        self.check_top_level()
        name = self.read_name()
        self.read_table()
        for section in BLOCKS:
            self.read_block(section)
        self.check_complete()
        self.check_pairs()
        criterion, model, solver = self.choices()
        self.problems.raise_if_any()
        return self.build(name, criterion, model, solver)

    def check_top_level(self) -> None:
        for entry in self.root:
            if entry.key not in TOP_KEYS:
                self.unknown(entry, "", TOP_KEYS)

    def read_name(self) -> str:
        default = re.sub(r"[^\w.+-]+", "-", self.path.stem).strip("-.") or "sweep"
        node = self.root.get("name")
        if node is None:
            return default[:80]
        if isinstance(node, Scalar) and _NAME.fullmatch(node.text):
            return node.text
        self.problems.add(
            node.place,
            "name",
            "must be up to 80 letters, digits, spaces and the signs - _ . +, as in m30-sizing",
        )
        return default

    def read_table(self) -> None:
        node = self.root.get("table")
        if node is None:
            return
        # The csv module and numpy are needed for tables only.
        from boulder_sweep.settings.table import read_table

        if not isinstance(node, Scalar) or not node.text.strip():
            self.problems.add(node.place, "table", "must be the name of a .csv or .parquet file")
            return
        # A path in the file is meant from the file's folder, one typed behind --set from where one stands.
        folder = self.path.parent if node.place.file == str(self.path) else Path()
        self.table = read_table(node, folder, self.problems)

    def read_block(self, section: str) -> None:
        entry = self.root.entries.get(section)
        if entry is None:
            self.blocks[section] = BLOCKS[section]()
            return
        node: Node = entry.value
        if isinstance(node, Scalar) and not node.text.strip() and not node.quoted:
            node = Mapping(node.place)  # a block of which every line is commented out
        if isinstance(node, Mapping):
            self.given |= {f"{section}.{inner.key}" for inner in node}
        try:
            block = BLOCKS[section].model_validate(node)
        except ValidationError as error:
            for line in error.errors():
                self.report(section, node, line)
            return
        self.blocks[section] = block
        for field in fields.fields_of(section):
            leaf = getattr(block, field.key)
            if leaf is not None:
                self.leaves[field.name] = leaf

    def report(self, section: str, node: Node, line: Any) -> None:
        """Turn one error of pydantic into a problem at its place."""
        key = ".".join(str(part) for part in (section, *line["loc"][:1]))
        if line["type"] == "extra_forbidden" and isinstance(node, Mapping):
            self.unknown(node.entries[line["loc"][0]], section, tuple(BLOCKS[section].model_fields))
        else:
            context = line.get("ctx", {})
            self.problems.add(context.get("place", node.place), key, context.get("message", line["msg"]))

    def unknown(self, entry: Entry, section: str, known: tuple[str, ...]) -> None:
        """Report a key nobody knows, with the nearest one that is known."""
        word = entry.key.lower()
        hint = ""
        own = next((f for f in fields.fields_of(section) if word in f.also), None)
        elsewhere = next((f for f in fields.FIELDS if word in (f.key, *f.also)), None)
        if own is not None:
            hint = f"; did you mean {own.key}?"
        elif not self.problems.full:
            hint = did_you_mean(entry.key, known)
        if not hint and elsewhere is not None:
            hint = f"; {elsewhere.key} belongs under {elsewhere.section}"
        where = f"under {section}" if section else "at the top level"
        name = shorten(entry.key) or "(empty)"
        path = f"{section}.{name}" if section else name
        self.problems.add(entry.place, path, f"is not known {where} (known: {', '.join(known)}){hint}")

    def check_complete(self) -> None:
        """Everything required is there, nothing twice, no axes beside a table."""
        listed = {} if self.table is None else self.table.columns
        for field in fields.FIELDS:
            in_file = field.path in self.given
            if field.name in listed and in_file:
                self.problems.add(
                    self.place_of(field),
                    field.path,
                    f"is given here and as column {field.name} of the table; remove one",
                )
            if (
                field.name not in fields.OPTIONAL
                and field.name not in listed
                and not in_file
                and not self.unread_table
            ):
                self.problems.add(self.place_of(field), field.path, "is required and missing")
        self.check_embedment(listed)
        if self.root.get("table") is not None:
            for name, leaf in self.leaves.items():
                if leaf.is_axis:
                    self.problems.add(
                        leaf.place,
                        fields.BY_NAME[name].path,
                        "takes one value beside a table; lists and ranges are axes of a grid",
                    )

    def check_embedment(self, listed: dict[str, Any]) -> None:
        named = [fields.BY_NAME[name] for name in fields.EMBEDMENT]
        present = [field for field in named if field.path in self.given or field.name in listed]
        keys = " or ".join(field.key for field in named)
        if not present and not self.unread_table:
            self.problems.add(self.place_of(named[0]), "site", f"{keys} is required and missing")
        elif len(present) > 1:
            self.problems.add(self.place_of(present[1]), present[1].path, f"give {keys}, not both")

    @property
    def unread_table(self) -> bool:
        """Whether a table is named that could not be read: what it lacks is then unknown."""
        return self.root.get("table") is not None and self.table is None

    def check_pairs(self) -> None:
        """Check single values that do not fit together; those of axes are told row by row."""
        bumper, hood = self.single("bumper_height_m"), self.single("hood_height_m")
        if bumper is not None and hood is not None and hood < bumper:
            key = "hood_height" if "vehicle.hood_height" in self.given else "bumper_height"
            self.problems.add(
                self.place_of(fields.BY_PATH[f"vehicle.{key}"]),
                f"vehicle.{key}",
                f"the hood ({hood:g} m) is lower than the bumper ({bumper:g} m)",
            )
        height, depth, impact = (
            self.single(name) for name in ("boulder_height_m", "embedment_depth_m", "impact_height_m")
        )
        ratio = self.single("embedment_ratio")
        if depth is None and ratio is not None and height is not None:
            depth = ratio * height
        if height is not None and depth is not None and impact is not None:
            exposed = height - depth
            if bumper is not None and exposed > bumper and impact > exposed * (1 + 1e-12):
                self.problems.add(
                    self.leaves["impact_height_m"].place,
                    "site.impact_height",
                    f"{impact:g} m is above the top of the boulder, which stands {exposed:g} m out of the ground",
                )

    def single(self, name: str) -> float | None:
        """Return the single value of a quantity, its default where it has one, None for axes and tables."""
        field = fields.BY_NAME[name]
        if self.table is not None and name in self.table.columns:
            return None
        leaf = self.leaves.get(name)
        if leaf is None:
            return None if field.path in self.given else field.default
        return None if leaf.is_axis else float(leaf.values[0])

    def choices(self) -> tuple[Criterion, Model, SolverSettings]:
        criterion, model, solver = (self.blocks.get(name) for name in ("criterion", "model", "solver"))
        result = Criterion(), Model(), SolverSettings()
        if isinstance(criterion, CriterionBlock):
            result = Criterion(criterion.max_rotation, criterion.rating), *result[1:]
        if isinstance(model, ModelBlock):
            result = result[0], Model(model.readings, model.soil), result[2]
        if {"solver.accuracy", "solver.step"} <= self.given:
            self.problems.add(
                self.key_place("solver", "step"), "solver.step", "give accuracy or step, not both"
            )
        elif isinstance(solver, SolverBlock):
            if solver.step is not None and solver.step > solver.horizon:
                self.problems.add(
                    self.key_place("solver", "step"),
                    "solver.step",
                    f"is longer than the horizon of {solver.horizon:g} s",
                )
            accuracy = solver.accuracy or ("balanced" if solver.step is None else None)
            result = *result[:2], SolverSettings(accuracy, solver.step, solver.horizon)
        return result

    def place_of(self, field: fields.Field) -> Place:
        return self.key_place(field.section, field.key)

    def key_place(self, section: str, key: str) -> Place:
        """Return where a key stands, else its block, else the beginning of the file."""
        entry = self.root.entries.get(section)
        if entry is None:
            return self.root.place
        inner = entry.value.entries.get(key) if isinstance(entry.value, Mapping) else None
        return entry.place if inner is None else inner.place

    def build(self, name: str, criterion: Criterion, model: Model, solver: SolverSettings) -> Sweep:
        """Put the checked parts together; axes in the order of the file."""
        from boulder_sweep.settings.notes import notes_on
        from boulder_sweep.settings.sweep import Axis, Sweep

        axes: list[Axis] = []
        count = 1
        for section in self.root:
            if section.key not in fields.SECTIONS or not isinstance(section.value, Mapping):
                continue
            for entry in section.value:
                field = fields.BY_PATH[f"{section.key}.{entry.key}"]
                leaf = self.leaves[field.name]
                if leaf.is_axis:
                    axes.append(Axis(field.name, leaf.values))
                    count *= len(leaf.values)
        if count > MAX_DESIGNS:
            self.problems.add(
                self.root.place, "", f"the grid has {count} designs; at most {MAX_DESIGNS} can be numbered"
            )
            self.problems.raise_if_any()
        listed = set() if self.table is None else set(self.table.columns)
        constants: dict[str, float] = {}
        for field in fields.FIELDS:
            value = self.single(field.name)
            if value is not None and field.name not in listed:
                constants[field.name] = value
        sweep = Sweep(name, self.path, tuple(axes), constants, self.table, criterion, model, solver)
        places = {field.name: self.place_of(field) for field in fields.FIELDS}
        object.__setattr__(sweep, "notes", tuple(notes_on(sweep, places)))
        return sweep
