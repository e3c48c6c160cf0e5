"""Readings of an investigation in place of soil constants: ``spt: {n: 28, energy_ratio: 60 %, depth: 1.5 m}``.

They are worked out while the file is read and stand for entries of the table from then on; what was used is kept, so
that it can be printed, stored and reported.

A log of blow counts or of a cone becomes layers of sand. The model weighs soil by its depth: the subgrade reaction and
the passive pressure both grow in proportion to it. So the mean of a layer is weighted by depth, and layers are parted
where their means differ by more than the scatter of the correlation. Where there is a choice, the weaker soil is taken.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from boulder_sweep import investigation as sand
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.model import Bound, Field
from boulder_sweep.settings.problems import Position, Problems, SettingsError, wrong
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar, Sequence, block_of
from boulder_sweep.settings.units import UnitError, factor, quantity_text
from boulder_sweep.settings.values import FRACTILE_5, NumberError, quoted, read_block, read_single, split_number
from boulder_sweep.text import counted

CONE = "q_c"
WINDOW_M = 0.25
"""Thickness over which a cone is averaged: a boulder of a metre or two does not feel a thinner seam."""
TEST_M = 0.45
"""What a test with blow counts drives the sampler."""
CORRELATION_LENGTH_M = 1.0
"""Depth within which readings tell of the same soil, so that a layer has one independent reading a metre."""
FEWEST = 3
"""Readings from which a mean and a scatter are taken; of fewer the weakest counts."""
THINNEST_M = 0.3
"""A reading that stands for less is no layer of its own."""
MOST_LAYERS = 8
"""Up to so many layers are simulated many designs side by side."""
SOIL_KEYS = ("friction_angle", "density", "subgrade_reaction")
"""What readings stand for, as far as a file does not give it."""
_BLOWS, _SHARE = Bound(0.0, 1000.0, "a blow count"), Bound(0.3, 1.0, "60 % is usual")
_DEPTH = ("depth", "depth_m", "m", "depth of the reading below the ground", Bound(0.0, 200.0, "a depth"))
_READINGS = {
    "spt": (
        ("n", "n", "1", "blows for the last 300 mm (1 ft), as logged", _BLOWS),
        ("energy_ratio", "energy_ratio", "1", "energy of the hammer that reaches the rods", _SHARE),
        ("n60", "n60", "1", "in place of these two: blows at an energy ratio of 60 %", _BLOWS),
        _DEPTH,
        ("n1_60", "n1_60", "1", "in place of n or n60: blow count corrected for energy and stress", _BLOWS),
    ),
    "cpt": (("q_c", "q_c_MPa", "MPa", "resistance of the cone", Bound(0.0, 150.0, "a cone resistance")), _DEPTH),
}
READING_FIELDS = {
    method: {key: Field(f"soil.{method}", key, name, unit, meaning, bound) for key, name, unit, meaning, bound in rows}
    for method, rows in _READINGS.items()
}
"""Entries of a reading by kind of test and key."""
BLOW_KEYS = ("n", "n60")
LEAST_KEYS = (*BLOW_KEYS, "n1_60", "q_c")
"""Entries that may be ``>50`` or ``50+``, at least so much; blows may be a refusal, too, ``50/75mm`` or ``R``, or none,
``WOH``."""
_AT_LEAST = re.compile(
    r"(?:>=?|≥)\s*(?P<above>[\d.].*)|(?P<plus>\d[\d.]*)\s*\+(?P<unit>[^\d]*)"
    r"|(?P<blows>\d+)\s*(?:/|\b(?:blows?\s+)?(?:for|in)\b)\s*(?P<driven>[\d.].*)|(?P<refusal>R|ref\.?|refusal)",
    re.IGNORECASE | re.ASCII,
)
WEIGHT = re.compile(r"WO?[HR]", re.IGNORECASE)
"""The sampler sank under the weight of the hammer or of the rods: no blow."""
_FIRST_M = 1.0
"""Depth above which the first reading of a log is expected."""
REFUSAL_BLOWS = 50
"""Blows at which a test is given up where the log has no count: within 150 mm, by ASTM D1586."""
_DRIVEN_M = 0.3048
"""What the blows of a count drive the sampler, 300 mm or 1 ft."""
_LOOSENESS = Bound(0.0, 1.0, "a share, 0.65 or 65 %")
RELATIVE_DENSITY = Field(
    "soil", "relative_density", "relative_density", "1", "relative density of the sand", _LOOSENESS
)
TOPSOIL = Field(
    "soil",
    "topsoil",
    "topsoil_m",
    "m",
    "depth of the topsoil: readings in it are left out",
    Bound(0.0, 0.5, "what lies deeper bears; give soil.layers"),
)
LOG, HOLE, ENERGY = "log", "hole", "energy_ratio"
"""A file with readings; beside it the hole in it, and the energy of the hammer where the file does not give it."""
METHODS = (*READING_FIELDS, RELATIVE_DENSITY.key, LOG)
SOURCE_OF_DENSITY = "EM 1110-2-2504, Table 3-1"
_SCATTER_DEG = {"spt": sand.SPT_SD_DEG, "cpt": sand.CPT_SD_DEG, RELATIVE_DENSITY.key: sand.DENSITY_SD_DEG}
CORRELATION = 0.99
"""Correlation of friction angle and subgrade reaction where the second follows from the first; 1 is not admitted."""
IN_TOPSOIL, BELOW_FOOT, HARD_SPOT = "topsoil", "below the foot", "a hard spot"
"""Why a reading is left out."""

Located = list[tuple[Position, dict[str, Any]]]
"""Readings as plain data, each with its position in the file."""


def _readings_of(node: Node, method: str, density_kg_m3: float | None) -> Located:
    """Return the readings of a test as plain data; of a mistake in many readings the first is reported.

    A reading is ``{n: 28, energy_ratio: 60 %, depth: 1.5 m}``, ``{n1_60: 30}`` or ``{q_c: 14 MPa, depth: 1.5 m}``.
    """
    if method == RELATIVE_DENSITY.key:
        return [(node.position, {method: read_single(node, RELATIVE_DENSITY)})]
    items = node.items if isinstance(node, Sequence) and node.unit is None else [node]
    if not items:
        raise wrong(node.position, "the list is empty; give at least one reading")
    readings, problems = [], Problems()
    for item in items:
        with problems.under():
            readings.append((item.position, _reading(item, method, density_kg_m3)))
    problems.raise_unlike()
    return readings


def _reading(node: Node, method: str, density_kg_m3: float | None) -> dict[str, Any]:
    """Return one reading of a penetration test."""
    plain, is_least = _without_signs(node)
    values: dict[str, Any] = read_block(plain, READING_FIELDS[method], "a reading")
    position = node.position
    if "n60" in values:
        if {"n", "energy_ratio"} & set(values):
            raise wrong(position, "n60 is at an energy ratio of 60 %; give it, or n and energy_ratio, not both")
        values |= {"n": values.pop("n60"), "energy_ratio": 0.6}
    if method == "spt":
        if "n1_60" in values and {"n", "energy_ratio"} & set(values):
            raise wrong(position, "give n or n60, or n1_60, which is corrected already, not both")
        if "n1_60" not in values and not {"n", "energy_ratio", "depth_m"} <= set(values):
            message = "a reading is n, the blows as logged, with energy_ratio and depth; n60, the blows at an energy "
            message += "ratio of 60 %, with depth; or n1_60, which is corrected for the stress, too"
            raise wrong(position, message)
    elif len(values) < 2:
        raise wrong(position, "a reading of a cone has q_c and depth")
    if "n1_60" not in values:
        stress = sand.vertical_stress(values["depth_m"], density_kg_m3)
        values |= {"stress_kPa": stress, "stress_factor": sand.stress_factor(stress)}
        if method == "spt":
            values["rod_factor"] = sand.rod_factor(values["depth_m"])
            values["n1_60"] = sand.normalized_blow_count(values["n"], values["energy_ratio"], values["depth_m"], stress)
    return values | ({"at_least": True} if is_least else {})


def _without_signs(node: Node) -> tuple[Node, bool]:
    """Return a reading with plain numbers in place of ``>50``, ``50+``, ``50/75mm`` and ``R``, and whether it had one.

    Raise `SettingsError` for blows over a penetration without a unit, or over more than the last 300 mm.
    """
    if not isinstance(node, Mapping):
        return node, False
    entries, is_least = dict(node.entries), False
    for key in LEAST_KEYS:
        value = node.get(key)
        if key in BLOW_KEYS and isinstance(value, Scalar) and WEIGHT.fullmatch(value.text.strip()):
            entries[key] = Entry(key, entries[key].position, Scalar(value.position, "0"))
            continue
        match = _AT_LEAST.fullmatch(value.text.strip()) if isinstance(value, Scalar) else None
        if value is None or match is None or (key not in BLOW_KEYS and not (match["above"] or match["plus"])):
            continue
        is_least = True
        if match["blows"]:
            is_least = _driven(value, match["driven"]) < 0.3
        text = match["above"] or match["blows"] or (match["plus"] and match["plus"] + match["unit"])
        entries[key] = Entry(key, entries[key].position, Scalar(value.position, text or str(REFUSAL_BLOWS)))
    return Mapping(node.position, entries, node.unit), is_least


def _driven(node: Node, text: str) -> float:
    """Return over how many metres blows were counted, by the text behind them."""
    try:
        number, unit = split_number(text, "m")
        driven = float(number * factor(unit, "m")) if unit else 0.0
    except (NumberError, UnitError) as error:
        raise wrong(node.position, f"{quoted(node)}: {error}") from None
    if not unit:
        raise wrong(node.position, f"{quoted(node)} lacks the unit of the penetration; write it as in 50/75mm")
    if not 0.0 <= driven <= _DRIVEN_M:
        raise wrong(node.position, f"{quoted(node)} is no count of the last 300 mm (1 ft); give the blows of these")
    return driven


def _leave_out(readings: Located, foot_m: float, topsoil_m: float) -> None:
    """Mark the readings that say nothing of the soil which bears: in the topsoil, or below the first under the foot."""
    depths = [reading["depth_m"] for _, reading in readings if "depth_m" in reading]
    last = min((depth for depth in depths if depth > foot_m), default=math.inf)
    for _, reading in readings:
        if reading.get("depth_m", topsoil_m) < topsoil_m:
            reading["left_out"] = IN_TOPSOIL
        elif reading.get("depth_m", 0.0) > last:
            reading["left_out"] = BELOW_FOOT


def _take_angles(node: Node, method: str, readings: Located, lacking: Collection[str]) -> None:
    """Give every reading that counts its friction angles, by the sources of the correlations.

    One above the range of the correlations gets the angles at its end. Raise `SettingsError` for readings that are too
    weak for the correlations, in one mistake, and where no reading counts.
    """
    counting = [(position, reading) for position, reading in readings if "left_out" not in reading]
    if not counting:
        message = f"every reading lies in the topsoil (soil.topsoil); {_as_measured(lacking)}"
        raise wrong(node.position, message)
    weak: list[tuple[Position, dict[str, Any], str]] = []
    for position, reading in counting:
        try:
            angles = _angles(method, reading)
        except sand.AboveError as error:
            if method not in sand.STRONGEST:
                raise wrong(position, f"{error}; {_as_measured(lacking)}") from None
            angles = sand.STRONGEST[method]
            reading["above_range"] = True
        except sand.OutsideError as error:
            weak.append((position, reading, str(error)))
            continue
        reading |= {"friction_angle_deg": min(angles.values()), "friction_angles_deg": angles}
    if not weak:
        return
    position, _, message = weak[0]
    depths = sorted(reading["depth_m"] for _, reading, _ in weak if "depth_m" in reading)
    if len(weak) > 1:
        where = f", at {_span(depths)}" if depths else ""
        message += f"; {len(weak)} of the {len(counting)} readings that count are too weak for it{where}"
    message += f"; {_as_measured(lacking)}"
    firm = [reading["depth_m"] for _, reading in counting if "friction_angle_deg" in reading and "depth_m" in reading]
    assert TOPSOIL.admitted is not None
    if len(depths) == len(weak) and depths[-1] < min(firm, default=0.0) <= TOPSOIL.admitted.high:
        message += f"; or, where this is topsoil, soil.topsoil: {min(firm):g} m"
    raise wrong(position, message)


def _angles(method: str, reading: dict[str, Any]) -> dict[str, float]:
    """Return the friction angles [deg] by a reading, by their sources."""
    if method == "spt":
        return sand.angles_by_blow_count(reading["n1_60"])
    if method == "cpt":
        return sand.angles_by_cone(reading["q_c_MPa"], reading["stress_kPa"])
    return {SOURCE_OF_DENSITY: sand.angle_by_relative_density(reading[method])}


def _as_measured(lacking: Collection[str]) -> str:
    """Return which constants a file must give where readings cannot stand for them."""
    *others, last = (f"soil.{key}" for key in lacking)
    return f"give {' and '.join([', '.join(others), last] if others else [last])} as measured"


def _span(depths: list[float], units: str = "si") -> str:
    """Return sorted depths [m] in words, by their ends."""
    return quantity_text("m", units, *dict.fromkeys((depths[0], depths[-1])), digits=".3g")


def covered_depth(derived: dict[str, Any]) -> float:
    """Return how deep a foot may be so that no other readings count for it [m]; by `Sweep.derived`.

    It must be less than this. Infinity where no reading below the foot was left out.
    """
    ends = [math.inf]
    for data in derived.get("soil", ()):
        if any(reading.get("left_out") == BELOW_FOOT for reading in data["readings"]):
            ends.append(max(reading.get("depth_m", 0.0) for reading in _counting(data["readings"])))
    return min(ends)


class LogReading(NamedTuple):
    """One reading of a file; its text is empty where there is none, and a plain number [MPa] for a cone."""

    position: Position
    depth_m: float
    text: str
    energy_ratio: str


class Log(NamedTuple):
    """The readings of a hole, from the top down, all with a depth and a value."""

    key: str
    """What they are by the keys of a reading: ``n``, ``n60``, ``n1_60`` or ``q_c``."""
    readings: tuple[LogReading, ...]
    file: str
    hole: str
    """The file as it is named in the settings, and the hole in it."""
    remarks: tuple[str, ...]
    """What of the file was not used."""
    water_m: float | None = None
    """Least depth of the ground water that the file gives [m]."""
    may_be_layered: bool = True
    """Whether the soil may have layers: it is no named one, and the file gives no constant that is not one value."""
    shallowest_m: float = math.inf
    """The shallowest foot of all designs [m]."""

    def averaged(self, topsoil_m: float) -> tuple[LogReading, ...]:
        """Return one reading for each `WINDOW_M` below the topsoil: the lower of mean and median of the cone."""
        windows: dict[int, list[LogReading]] = {}
        for one in self.readings:
            windows.setdefault(math.floor((one.depth_m - topsoil_m) / WINDOW_M + 1e-9), []).append(one)
        return tuple(_average(window) for window in windows.values())


def _average(window: list[LogReading]) -> LogReading:
    values = [float(one.text) for one in window]
    value = max(0.0, min(float(np.mean(values)), float(np.median(values))))
    return window[0]._replace(depth_m=float(np.mean([one.depth_m for one in window])), text=repr(value))


class LogLayer(NamedTuple):
    """Readings that belong to one layer."""

    from_m: float
    to_m: float
    readings: int
    """How many there are."""
    angles: dict[str, float]
    """Friction angles [deg] by the sources of the correlations."""
    scatter_deg: float
    """Standard deviation of their mean [deg]; 0 for fewer than `FEWEST` readings."""


def layers_of(
    readings: list[dict[str, Any]],
    foot_m: float,
    scatter_deg: float,
    *,
    is_cone: bool,
    shallowest_m: float = math.inf,
) -> list[LogLayer]:
    """Return the layers of a log, from the ground down, by the depths and friction angles of the readings that count.

    No boulder is judged in soil that only a deeper foot reaches: of the means of a layer down to any foot, the lowest
    counts. The shallowest foot [m] is infinity where there is one foot only. The last reading stands for the soil down
    to the deepest foot [m]; one below it counts in full where it is weaker than the one above, else for its share of
    the soil down to the foot. Means that differ by more than the standard deviation of the correlation [deg] belong to
    two layers. Of a cone a reading is the mean of `WINDOW_M`, and a boundary lies at its end, else at the depth of the
    stronger reading of the two. Readings that are no layer of their own, strong alone between weaker ones, are marked
    as left out.
    """
    by_depth = sorted(readings, key=lambda one: (one["depth_m"], -one["friction_angle_deg"]))
    readings = list({round(one["depth_m"], 3): one for one in by_depth}.values())  # of one depth the weakest
    depths = np.array([reading["depth_m"] for reading in readings])
    angles = np.array([reading["friction_angle_deg"] for reading in readings])
    reach = 0.5 * WINDOW_M if is_cone else 0.0
    last = max(foot_m if math.isfinite(foot_m) else 0.0, depths[-1] + (reach or TEST_M))
    edges = np.concatenate([[0.0], 0.5 * (depths[1:] + depths[:-1]), [last]])
    adds_strength = len(depths) > 1 and depths[-1] > foot_m and angles[-1] >= angles[-2]
    ends = np.append(edges[:-1], max(foot_m, edges[-2])) if adds_strength else edges
    cuts = _cuts(angles, edges, scatter_deg)
    groups = [slice(*ends) for ends in pairwise([0, *cuts, len(readings)])]
    means = [float(np.average(angles[group], weights=np.diff(edges**2)[group])) for group in groups]
    bounds = [0.0]
    for (upper, below), cut in zip(pairwise(means), cuts, strict=True):
        bounds.append(depths[cut - 1] + reach if upper > below else max(0.0, depths[cut] - reach))
    bounds.append(last)
    spans = list(pairwise(bounds))
    firm = [group for group, (top, bottom) in zip(groups, spans, strict=True) if bottom - top >= 0.5 * WINDOW_M]
    if firm and len(firm) < len(groups):  # without what is strong alone between weaker ones
        for reading in (one for group in groups if group not in firm for one in readings[group]):
            reading["left_out"] = HARD_SPOT
        kept = [reading for group in firm for reading in readings[group]]
        return layers_of(kept, foot_m, scatter_deg, is_cone=is_cone, shallowest_m=shallowest_m)
    feet = [*(foot for foot in (shallowest_m, *ends[:-1]) if shallowest_m <= foot < ends[-1]), ends[-1]]
    layers = []
    for group, (top, bottom) in zip(groups, spans, strict=True):
        weights = 0.5 * np.diff(np.minimum.outer(feet, ends[group.start : group.stop + 1]) ** 2)
        rows = [row for row in weights if row.any()] or [np.ones(group.stop - group.start)]
        found = [_layer(readings[group], row, float(top), float(bottom)) for row in rows]
        layers.append(min(found, key=lambda layer: min(layer.angles.values())))
    return layers


def _cuts(angles: np.ndarray, edges: np.ndarray, scatter_deg: float) -> list[int]:
    """Return before which readings a layer begins.

    From one layer a reading, neighbours whose means do not differ by more than the scatter become one, those first that
    add the least to the squared deviations; and so do layers that are too thin, and the most alike of too many.
    """
    cuts = list(range(1, len(angles)))
    while cuts:
        ends = np.array([0, *cuts, len(angles)])
        weights = 0.5 * np.diff(edges[ends] ** 2)
        thick = np.diff(edges[ends])
        sums = np.add.reduceat(0.5 * np.diff(edges**2) * angles, ends[:-1])
        apart = np.abs(np.diff(sums / weights))
        added = weights[1:] * weights[:-1] / (weights[1:] + weights[:-1]) * apart**2
        alike = (apart <= scatter_deg) | (np.minimum(thick[1:], thick[:-1]) < THINNEST_M) | (len(cuts) >= MOST_LAYERS)
        if not alike.any():
            break
        del cuts[int(np.argmin(np.where(alike, added, np.inf)))]
    return cuts


def _layer(readings: list[dict[str, Any]], weights: np.ndarray, top: float, bottom: float) -> LogLayer:
    """Return a layer by its readings and their weights; those without weight do not count."""
    readings, weights = [one for one, weight in zip(readings, weights, strict=True) if weight], weights[weights > 0.0]
    n = len(readings)
    if n < FEWEST:
        weakest = min(readings, key=lambda reading: reading["friction_angle_deg"])
        return LogLayer(top, bottom, n, weakest["friction_angles_deg"], 0.0)
    share = weights / weights.sum()
    values = {
        source: np.array([reading["friction_angles_deg"][source] for reading in readings])
        for source in readings[0]["friction_angles_deg"]
    }
    angles = {source: float(share @ one) for source, one in values.items()}
    lowest = min(angles, key=angles.__getitem__)
    variance = float(share @ (values[lowest] - angles[lowest]) ** 2) * n / (n - 1)
    independent = min(float(n), max(1.0, (bottom - top) / CORRELATION_LENGTH_M))
    return LogLayer(top, bottom, n, angles, math.sqrt(variance / independent))


def _soil_of(
    node: Node,
    method: str,
    lacking: Collection[str],
    density_kg_m3: float | None,
    foot_m: float,
    topsoil_m: float,
    log: Log | None,
) -> dict[str, Any]:
    """Return the soil constants by readings as plain data: the readings, and what is taken of them.

    Of several readings the weakest counts, from the topsoil down to the first below the deepest foot, and of several
    correlations the lowest; a log makes layers of them. The standard deviation is the scatter about it, or what keeps
    the highest correlation within the 95 % fractile, if that is more. Where the file lacks no constant (`SOIL_KEYS`),
    the readings are only recorded.
    """
    located = _readings_of(node, method, density_kg_m3)
    readings = [reading for _, reading in located]
    data: dict[str, Any] = {"method": method, "readings": readings}
    if log is not None:
        data["log"] = {"file": log.file, "hole": log.hole, "remarks": list(log.remarks)}
        data |= {} if math.isinf(foot_m) else {"foot_m": foot_m}
    if not lacking:
        return data
    _leave_out(located, foot_m, topsoil_m)
    _take_angles(node, method, located, lacking)
    if any(reading.get("left_out") == BELOW_FOOT for reading in readings):
        data["foot_m"] = foot_m
    if log is None:
        return data | _constants(node, method, lacking, _weakest(readings)["friction_angles_deg"])
    return data | _of_log(node, method, lacking, readings, log, density_kg_m3, foot_m)


def _constants(
    node: Node, method: str, lacking: Collection[str], angles: dict[str, float], scatter_deg: float | None = None
) -> dict[str, Any]:
    """Return the soil constants by the friction angles [deg] of some correlations, and the scatter of readings."""
    source = min(angles, key=angles.__getitem__)
    angle, highest = angles[source], max(angles.values())
    sd = max(_SCATTER_DEG[method], math.ceil(100.0 * (highest - angle) / FRACTILE_5) / 100.0)
    data: dict[str, Any] = {"source": source}
    if scatter_deg is not None:
        data |= {"correlation_sd_deg": sd, "scatter_sd_deg": scatter_deg}
        sd = math.ceil(100.0 * math.hypot(sd, scatter_deg) - 1e-9) / 100.0
        data["total_sd_deg"] = sd
    if "friction_angle" in lacking:
        data |= {"friction_angle_deg": angle, "friction_angle_sd_deg": sd}
    if "density" in lacking:
        data["density_low_kg_m3"], data["density_high_kg_m3"] = sand.densities(angle)
    if "subgrade_reaction" in lacking:
        if angle < sand.API_ANGLES[0]:
            message = f"the API curve begins at {sand.API_ANGLES[0]:g} deg, and these readings give {angle:.4g} deg"
            raise wrong(node.position, f"{message}; {_as_measured(['subgrade_reaction'])}")
        # The curve as it is; what the angle may be off by is carried along it, at the slope of its logarithm.
        curve = sand.api_curve(np.array([angle, *sand.API_ANGLES]))
        spread = sd * math.log(curve[2] / curve[1]) / float(sand.API_ANGLES[1] - sand.API_ANGLES[0])
        data |= {"subgrade_reaction_MN_m3": float(curve[0]), "subgrade_reaction_cov": math.sqrt(math.expm1(spread**2))}
    return data


def _of_log(
    node: Node,
    method: str,
    lacking: Collection[str],
    readings: list[dict[str, Any]],
    log: Log,
    density_kg_m3: float | None,
    foot_m: float,
) -> dict[str, Any]:
    """Return the constants of the uppermost layer of a log, and of the deeper ones what 5 % fall below.

    Only single values can be given for deeper layers. Where there can be none, the weakest layer counts at every depth.
    """
    is_cone, sd = method == "cpt", _SCATTER_DEG[method]
    found = layers_of(_counting(readings), foot_m, sd, is_cone=is_cone, shallowest_m=log.shallowest_m)
    layers: list[dict[str, Any]] = []
    for layer in found:
        constants = _constants(node, method, lacking, layer.angles, layer.scatter_deg)
        said: dict[str, Any] = {"from_m": layer.from_m, "to_m": layer.to_m, "readings": layer.readings}
        layers.append(said | {"friction_angles_deg": layer.angles} | constants)
    data: dict[str, Any] = {"layers": layers}
    if not log.may_be_layered and len(layers) > 1:
        weakest = min(layers, key=_weak_angle)
        return data | {"weakest_layer": layers.index(weakest)} | _taken(weakest)
    for deeper in layers[1:]:
        spread = math.sqrt(math.log1p(deeper["subgrade_reaction_cov"] ** 2))
        share = math.exp(-0.5 * spread * spread - FRACTILE_5 * spread)
        low, high = (deeper.get(f"density_{end}_kg_m3", density_kg_m3 or 0.0) for end in ("low", "high"))
        deeper["weak"] = {
            "density_kg_m3": low + 0.05 * (high - low),
            "friction_angle_deg": _weak_angle(deeper),
            "subgrade_reaction_MN_m3": deeper["subgrade_reaction_MN_m3"] * share,
        }
    return data | _taken(layers[0])


def _weak_angle(layer: dict[str, Any]) -> float:
    """Return the friction angle [deg] that 5 % fall below."""
    angle: float = min(layer["friction_angles_deg"].values())
    return angle - FRACTILE_5 * float(layer["total_sd_deg"])


def _taken(layer: dict[str, Any]) -> dict[str, Any]:
    """Return the constants of a layer."""
    return {name: value for name, value in layer.items() if name not in ("from_m", "to_m", "readings", "weak")}


def _counting(readings: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [reading for reading in readings if "left_out" not in reading]


def _weakest(readings: list[dict[str, Any]]) -> dict[str, Any]:
    return min(_counting(readings), key=lambda reading: reading["friction_angle_deg"])


def soil_words(data: dict[str, Any], units: str = "si") -> str:
    """Return in one line what is taken of readings, by `Sweep.derived`."""
    remarks = data["log"]["remarks"] if "log" in data else []
    if not data.keys() & {"friction_angle_deg", "density_low_kg_m3", "subgrade_reaction_MN_m3"}:
        return "; ".join(["the readings are kept for the record: the file gives every constant", *remarks])
    if "log" in data:
        return "; ".join([*_log_words(data, units), *_remarks(data, units), *remarks])
    weakest = _weakest(data["readings"])
    count = len(_counting(data["readings"]))
    of = f"{_reading_words(weakest, units)}{f', the weakest of {count} readings' if count > 1 else ''}"
    parts = _constant_words(data, weakest["friction_angles_deg"], of, units)
    return "; ".join([*parts, *_remarks(data, units)])


def _constant_words(data: dict[str, Any], angles: dict[str, float], of: str, units: str) -> list[str]:
    """Return the constants that readings give, and by what."""
    parts = []
    if "friction_angle_deg" in data:
        angle, sd = data["friction_angle_deg"], data["friction_angle_sd_deg"]
        others = "".join(
            f"; by {name} it is {other:.4g} deg" for name, other in angles.items() if name != data["source"]
        )
        source = f"{data['source']}{', the lowest' if others else ''}{others}"
        parts.append(f"friction angle {angle:.4g} deg, sd {sd:.3g} deg, by {of} ({source})")
    if "density_low_kg_m3" in data:
        ends = data["density_low_kg_m3"], data["density_high_kg_m3"]
        density = quantity_text("kg/m^3", units, *ends, digits=".0f")
        parts.append(f"density {density}, uniform (EM 1110-2-2504, Table 3-1)")
    if "subgrade_reaction_MN_m3" in data:
        beta = quantity_text("MN/m^3", units, data["subgrade_reaction_MN_m3"], digits=".3g")
        cov = data["subgrade_reaction_cov"]
        parts.append(f"subgrade reaction {beta}, cov {100.0 * cov:.0f} %, which follows the angle (API)")
    return parts


def log_title(data: dict[str, Any]) -> str:
    """Return the file of a log, and the hole in it."""
    return ", hole ".join(filter(None, (data["log"]["file"], data["log"]["hole"])))


def shown_readings(data: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the readings of a log from the ground down, but those below the first one under the deepest foot."""
    shown = (one for one in data["readings"] if one.get("left_out") != BELOW_FOOT)
    return sorted(shown, key=lambda one: one["depth_m"])


def strength(reading: dict[str, Any]) -> float:
    """Return the value of a reading that is drawn: q_c [MPa], or blows."""
    return float(reading.get("q_c_MPa", reading.get("n", reading.get("n1_60", 0.0))))


def _log_words(data: dict[str, Any], units: str) -> list[str]:
    """Return what is taken of the layers of a log."""
    layers = data["layers"]
    window = quantity_text("m", units, WINDOW_M)
    kind, kinds = "blow count", "blow counts"
    if data["method"] == "cpt":
        kind, kinds = f"mean of the cone over {window}", f"means of the cone over {window}"
    parts = [log_title(data)]
    if "weakest_layer" in data:
        parts.append(f"the weakest of {len(layers)} layers stands for all depths")
        layers = [layers[data["weakest_layer"]]]
    for layer in layers:
        count, ends = layer["readings"], [layer["from_m"], layer["to_m"]]
        of = f"{count} {kind if count == 1 else kinds} at {quantity_text('m', units, *ends, digits='.3g')}"
        if count >= FEWEST:
            correlation, mean = layer["correlation_sd_deg"], layer["scatter_sd_deg"]
            of += f", sd {correlation:.3g} deg of the correlation with {mean:.2g} deg of their mean"
        elif count > 1:
            of = f"the weakest of {of}"
        if "weak" not in layer:
            parts += _constant_words(layer, layer["friction_angles_deg"], of, units)
            continue
        weak = layer["weak"]
        density = quantity_text("kg/m^3", units, weak["density_kg_m3"], digits=".0f")
        beta = quantity_text("MN/m^3", units, weak["subgrade_reaction_MN_m3"], digits=".3g")
        angle, *_ = _constant_words(layer, {}, of, units)
        taken = f"{weak['friction_angle_deg']:.4g} deg, {density}, {beta}"
        parts.append(f"below {quantity_text('m', units, ends[0], digits='.3g')} the 5 % of each, {taken}: {angle}")
    return parts


def _remarks(data: dict[str, Any], units: str) -> list[str]:
    """Return which readings are left out, which are taken at the end of a range, and where a log has none."""
    foot = quantity_text("m", units, data.get("foot_m", 0.0))
    kinds = (
        ("above_range", True, "above the range of the correlation, taken as its end"),
        ("left_out", IN_TOPSOIL, "left out, in the topsoil"),
        ("left_out", HARD_SPOT, f"left out, {HARD_SPOT} between weaker ones"),
        ("left_out", BELOW_FOOT, f"left out, below the first one under the deepest foot ({foot})"),
    )
    remarks = []
    for key, value, words in kinds:
        some = [reading for reading in data["readings"] if reading.get(key) == value]
        some = [reading for reading in some if key == "left_out" or "left_out" not in reading]
        if some:
            depths = sorted(reading["depth_m"] for reading in some if "depth_m" in reading)
            where = f" at {_span(depths, units)}" if depths else ""
            remarks.append(f"{counted(len(some), 'reading')}{where} {words}")
    depths = sorted(reading["depth_m"] for reading in _counting(data["readings"])) if "log" in data else []
    if depths and depths[0] > _FIRST_M:
        remarks.append(f"begins at {_span(depths[:1], units)}; its first reading stands for the soil above")
    if depths and depths[-1] < data.get("foot_m", 0.0):
        remarks.append(f"ends at {_span(depths[-1:], units)}; its last reading stands for the soil down to the foot")
    return remarks


def _reading_words(reading: dict[str, Any], units: str) -> str:
    depth = quantity_text("m", units, reading.get("depth_m", 0.0))
    least = "at least " if "at_least" in reading else ""
    if "q_c_MPa" in reading:
        resistance = quantity_text("MPa", units, reading["q_c_MPa"])
        return f"q_c {least}{resistance} at {depth}, C_N {reading['stress_factor']:.3g}"
    if "relative_density" in reading:
        return f"relative density {100.0 * reading['relative_density']:g} %"
    if "n" not in reading:
        return f"(N1)60 {least}{reading['n1_60']:.4g}{f' at {depth}' if 'depth_m' in reading else ''}"
    energy = f"{100.0 * reading['energy_ratio']:g} %"
    factors = f"C_N {reading['stress_factor']:.3g}, rods {reading['rod_factor']:g}"
    corrected = f"(N1)60 {reading['n1_60']:.4g}"
    return f"N {least}{reading['n']:g} ({energy}) at {depth}, {corrected} with {factors}"


def unfold_soils(
    root: Mapping,
    listed: Collection[str],
    feet_m: tuple[float, float],
    problems: Problems,
    read_log: Callable[[Scalar, Scalar | None], Log],
) -> list[dict[str, Any]]:
    """Replace the readings of every soil in the tree of a file by distributions of the constants that it does not give.

    Return what is kept of each as plain data, under the name of its soil where it is a named one. `listed` are keys of
    the soil that a table of designs gives; the feet are the shallowest and the deepest of all designs [m]; problems
    receive what is wrong with the readings; logs are read by the names of their file and hole.
    """
    data: list[dict[str, Any]] = []
    shallowest_m, foot_m = feet_m
    for soil in root.blocks("soil"):
        given = [key for key in METHODS if key in soil.entries]
        topsoil_m, topsoil = 0.0, soil.entries.pop(TOPSOIL.key, None)
        if topsoil is not None:
            with problems.under():
                topsoil_m = read_single(topsoil.value, TOPSOIL)
                if not set(given) & {*READING_FIELDS, LOG}:
                    message = "topsoil says which readings are left out; give it with spt or cpt, or with a log"
                    raise wrong(topsoil.position, message)
        beside = {key: soil.entries.pop(key) for key in (HOLE, ENERGY) if key in soil.entries}
        for key, one in beside.items():
            if LOG not in given:
                problems.add(one.position, f"{key} goes with soil.log, the file of a borehole or a cone")
        if not given:
            continue
        entry = soil.entries[given[0]]
        lacking = [key for key in SOIL_KEYS if key not in soil.entries and key not in listed]
        constants: dict[str, Any] = {}
        with problems.under():
            if len(given) > 1:
                raise wrong(soil.entries[given[1]].position, f"give one of {', '.join(given)}")
            if "water_table" in soil.entries and "subgrade_reaction" in lacking:
                message = "the API curve holds for dry sand; with a water table give soil.subgrade_reaction"
                raise wrong(entry.position, message)
            density, node, method, log = _plain_density(soil), entry.value, given[0], None
            if method == LOG:
                log = _opened(node, beside, read_log)
                needed = {"friction_angle", "subgrade_reaction"} | ({"density"} if density is None else set())
                is_one = soil.label or "layers" in soil.entries or not needed <= set(lacking) or math.isinf(foot_m)
                log = log._replace(may_be_layered=not is_one, shallowest_m=shallowest_m)
                if log.water_m is not None and log.water_m < foot_m and "water_table" not in soil.entries:
                    words = f"ground water at {log.water_m:g} m in {log.file} is not used; give soil.water_table"
                    words += " and soil.subgrade_reaction" if "subgrade_reaction" in lacking else ""
                    words += ", in a file of its own" if soil.label else ""
                    log = log._replace(remarks=(*log.remarks, words))
                method, node = _nodes_of(log, node.position, beside.get(ENERGY), topsoil_m)
            constants = _soil_of(node, method, lacking, density, foot_m, topsoil_m, log)
            data.append(soil.label | constants)
        for key in given[1:]:
            del soil.entries[key]
        soil.replace(given[0], _soil_entries(entry, constants))
    return data


def _opened(node: Node, beside: dict[str, Entry], read_log: Callable[[Scalar, Scalar | None], Log]) -> Log:
    """Read the log that an entry names."""
    if not isinstance(node, Scalar) or not node.text.strip():
        raise wrong(node.position, "must be the name of a file: .csv, .xlsx, .ags, .gef or .xml")
    hole = beside[HOLE].value if HOLE in beside else None
    if hole is not None and (not isinstance(hole, Scalar) or not hole.text.strip()):
        raise wrong(hole.position, "must be the name of a hole in the file")
    return read_log(node, hole)


def _nodes_of(log: Log, position: Position, energy: Entry | None, topsoil_m: float) -> tuple[str, Sequence]:
    """Return the kind of test and the readings of a log, as if they stood in the settings."""
    is_cone = log.key == CONE
    ratio = ""
    if energy is not None:
        if log.key != "n":
            raise wrong(energy.position, f"{log.file} gives {log.key}, which needs no energy ratio; remove it")
        problems = Problems()
        with problems.under(ENERGY):
            ratio = f"{read_single(energy.value, READING_FIELDS['spt'][ENERGY])!r}"
        problems.raise_if_any()
    if log.key == "n" and not ratio and not all(reading.energy_ratio for reading in log.readings):
        message = f"{log.file} does not give the energy ratio of the hammer for every count; write energy_ratio beside "
        raise wrong(position, f"{message}log (60 % is usual), or name counts at 60 % N60")
    items: list[Node] = []
    for reading in log.averaged(topsoil_m) if is_cone else log.readings:
        texts = {log.key: f"{reading.text} MPa" if is_cone else reading.text, "depth": f"{reading.depth_m!r} m"}
        texts |= {ENERGY: reading.energy_ratio or ratio} if log.key == "n" else {}
        items.append(block_of(reading.position, texts))
    return ("cpt" if is_cone else "spt"), Sequence(position, items)


def _plain_density(soil: Mapping) -> float | None:
    """Return the density of a soil where it is one plain value."""
    node = soil.get("density")
    try:
        return read_single(node, BY_NAME["soil_density_kg_m3"]) if isinstance(node, Scalar) else None
    except SettingsError:
        return None  # reported where it stands


def _soil_entries(entry: Entry, data: dict[str, Any]) -> list[Entry]:
    """Return the distributions that readings stand for."""
    forms: dict[str, dict[str, str]] = {}
    if "friction_angle_deg" in data:
        mean, sd = data["friction_angle_deg"], data["friction_angle_sd_deg"]
        forms["friction_angle"] = {"mean": f"{mean!r} deg", "sd": f"{sd!r} deg"}
    if "density_low_kg_m3" in data:
        ends = {end: f"{data[f'density_{end}_kg_m3']!r} kg/m^3" for end in ("low", "high")}
        forms["density"] = {"distribution": "uniform", **ends}
    if "subgrade_reaction_MN_m3" in data:
        mean, cov = data["subgrade_reaction_MN_m3"], data["subgrade_reaction_cov"]
        forms["subgrade_reaction"] = {"distribution": "lognormal", "mean": f"{mean!r} MN/m^3", "cov": f"{cov!r}"}
    entries = [Entry(key, entry.position, block_of(entry.value.position, form)) for key, form in forms.items()]
    deeper: list[Node] = []
    for layer in data.get("layers", ()):
        if "weak" in layer:
            weak = layer["weak"]
            texts = {
                "from": f"{layer['from_m']!r} m",
                "density": f"{weak['density_kg_m3']!r} kg/m^3",
                "friction_angle": f"{weak['friction_angle_deg']!r} deg",
                "subgrade_reaction": f"{weak['subgrade_reaction_MN_m3']!r} MN/m^3",
            }
            deeper.append(block_of(entry.value.position, texts))
    if deeper:
        entries.append(Entry("layers", entry.position, Sequence(entry.value.position, deeper)))
    return entries
