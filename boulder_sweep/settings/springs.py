"""The stages of a vehicle's spring: ``spring: [{stiffness: 3103 kN/m}, {beyond: 1 m, stiffness: 9000 kN/m}]``.

Written so or as entries of their own, ``spring``, ``second_spring`` and ``second_spring_from``, they mean the same. The
first form becomes the second before anything is read, so each number is an input like any other.
"""

from __future__ import annotations

from boulder_sweep.settings.leaf import Mistake
from boulder_sweep.settings.tree import Entry, Mapping, Sequence

KEYS = ({"stiffness"}, {"beyond", "stiffness"})
"""Keys of the first stage and of the second."""
FORM = "[{stiffness: ...}, {beyond: ..., stiffness: ...}]"


def unfold_springs(root: Mapping) -> list[Mistake]:
    """Replace the stages of every vehicle's spring by entries of their own, and return what is wrong with them.

    Parameters
    ----------
    root : Mapping
        The tree of the file, changed in place.
    """
    vehicle = root.get("vehicle")
    vehicles = vehicle.items if isinstance(vehicle, Sequence) else [vehicle]
    return [mistake for one in vehicles if isinstance(one, Mapping) for mistake in _unfold(one)]


def _unfold(vehicle: Mapping) -> list[Mistake]:
    """Replace the stages of one vehicle's spring."""
    spring = vehicle.get("spring")
    if not isinstance(spring, Sequence) or not any(isinstance(item, Mapping) for item in spring.items):
        return []
    stages = [item for item in spring.items if isinstance(item, Mapping)]
    if len(stages) < len(spring.items) or len(stages) > 2 or spring.unit is not None:
        del vehicle.entries["spring"]
        return [Mistake(spring.position, f"takes one stage or two: {FORM}")]
    mistakes = [
        Mistake(stage.position, f"a stage of the spring has {' and '.join(sorted(keys))}, as in {FORM}")
        for stage, keys in zip(stages, KEYS, strict=False)
        if set(stage.entries) != keys
    ]
    entries: dict[str, Entry] = {}
    for entry in vehicle:
        if entry.key == "spring" and not mistakes:
            entries |= _entries(stages)
        elif entry.key in entries and entry.position.line is not None:
            mistakes.append(Mistake(entry.position, f"{entry.key} stands in the stages of the spring, too; remove one"))
        elif entry.key != "spring":
            entries[entry.key] = entry  # what --set gives takes the place of what the file gives
    vehicle.entries = entries
    return mistakes


def _entries(stages: list[Mapping]) -> dict[str, Entry]:
    """Return the entries that the stages stand for."""
    found = {"spring": stages[0].entries["stiffness"]}
    for stage in stages[1:]:
        found |= {"second_spring_from": stage.entries["beyond"], "second_spring": stage.entries["stiffness"]}
    return {key: Entry(key, entry.position, entry.value) for key, entry in found.items()}
