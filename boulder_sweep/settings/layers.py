"""Layers of soil: how they are written."""

from __future__ import annotations

from boulder_sweep.settings.fields import BY_NAME, LAYER_TOP
from boulder_sweep.settings.leaf import LeafError, Mistake, read_single
from boulder_sweep.settings.model import Layer
from boulder_sweep.settings.problems import did_you_mean, shorten
from boulder_sweep.settings.tree import Mapping, Node, Sequence

WATER_KG_M3 = 1000.0
"""Density of water."""
MOST_LAYERS = 100
LAYER_FIELDS = {
    field.key: field
    for field in (
        LAYER_TOP,
        *(BY_NAME[name] for name in ("soil_density_kg_m3", "friction_angle_deg", "subgrade_reaction_MN_m3")),
        BY_NAME["cohesion_kPa"],
    )
}
"""Entries of a layer by key; all are required but the last."""
_NAMES = dict(zip(LAYER_FIELDS, Layer.__dataclass_fields__, strict=True))


def read_layers(node: Node) -> tuple[Layer, ...]:
    """Read ``[{from: 0.5 m, density: ..., friction_angle: ..., subgrade_reaction: ..., cohesion: ...}, ...]``.

    Raises
    ------
    LeafError
        With every mistake in the list.
    """
    if not isinstance(node, Sequence) or not 1 <= len(node.items) <= MOST_LAYERS:
        message = f"must be a list of 1 to {MOST_LAYERS} layers, each a block of keys: {', '.join(LAYER_FIELDS)}"
        raise LeafError([Mistake(node.position, message)])
    layers: list[Layer] = []
    mistakes: list[Mistake] = []
    for item in node.items:
        try:
            layer = _read_layer(item)
        except LeafError as error:
            mistakes.extend(error.mistakes)
            continue
        if layers and layer.from_m <= layers[-1].from_m:
            message = f"begins at {layer.from_m:g} m, not below the layer before it ({layers[-1].from_m:g} m)"
            mistakes.append(Mistake(item.position, message))
        layers.append(layer)
    if mistakes:
        raise LeafError(mistakes)
    return tuple(layers)


def _read_layer(node: Node) -> Layer:
    """Read one layer; single values only."""
    if not isinstance(node, Mapping):
        raise LeafError([Mistake(node.position, f"a layer must be a block of keys: {', '.join(LAYER_FIELDS)}")])
    values: dict[str, float] = {}
    mistakes: list[Mistake] = []
    for entry in node:
        field = LAYER_FIELDS.get(entry.key)
        if field is None:
            hint = did_you_mean(entry.key, tuple(LAYER_FIELDS))
            message = f"'{shorten(entry.key)}' is not a key of a layer ({', '.join(LAYER_FIELDS)}){hint}"
            mistakes.append(Mistake(entry.position, message))
            continue
        try:
            values[_NAMES[entry.key]] = read_single(entry.value, field)
        except LeafError as error:
            mistakes.extend(Mistake(found.position, f"{entry.key}: {found.message}") for found in error.mistakes)
    missing = [key for key in LAYER_FIELDS if key not in node.entries and key != "cohesion"]
    if missing:
        mistakes.append(Mistake(node.position, f"the layer lacks {', '.join(missing)}"))
    if mistakes:
        raise LeafError(mistakes)
    return Layer(**values)
