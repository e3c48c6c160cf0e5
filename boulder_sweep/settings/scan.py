"""A boulder by its scan: ``scan: {file: rock.ply, up: a, facing: b}`` becomes its profile and its density."""

from __future__ import annotations

from pathlib import Path

from boulder_sweep.errors import ScanError
from boulder_sweep.settings.fields import BY_NAME
from boulder_sweep.settings.leaf import LeafError, Mistake, read_single
from boulder_sweep.settings.problems import Position, did_you_mean, shorten
from boulder_sweep.settings.shape import Scan
from boulder_sweep.settings.tree import Entry, Mapping, Node, Scalar, Sequence
from boulder_sweep.settings.units import UnitError, factor

KEYS = ("file", "up", "facing", "unit")
FORM = "{file: rock.ply, up: a, facing: b}"
REPLACED = ("length", "width", "height", "taper", "profile")
"""Keys of the boulder that a scan stands for."""
MASS = BY_NAME["boulder_mass_kg"]


def unfold_scan(boulder: Mapping, folder: Path) -> Scan:
    """Replace the scan of a boulder, and the mass of the whole stone beside it, by profile and density.

    Parameters
    ----------
    boulder
        The block of the boulder, changed in place.
    folder
        Where the scan lies if its name is relative.

    Raises
    ------
    LeafError
        With every mistake in it.
    """
    entry = boulder.entries.pop("scan")
    words = _words(entry.value)
    mistakes = [
        Mistake(boulder.entries[key].position, f"{key} follows from the scan; remove one of them")
        for key in REPLACED
        if key in boulder.entries
    ]
    if len({"mass", "density"} & set(boulder.entries)) != 1:
        message = "beside a scan give the mass of the whole stone, or its density: one of them"
        mistakes.append(Mistake(entry.position, message))
    if mistakes:
        raise LeafError(mistakes)
    mass = boulder.entries.pop("mass", None)
    mass_kg = None if mass is None else read_single(mass.value, MASS)
    from boulder_sweep.stones.weighing import scanned

    try:
        metres = float(factor(words.get("unit", "m"), "m"))
        found = scanned(folder / words["file"], metres=metres, mass_kg=mass_kg)
        standing = found.stone.standing(words["up"], words["facing"])
    except (ScanError, UnitError) as error:
        raise LeafError([Mistake(entry.value.position, str(error))]) from None
    profile = standing.profile
    points = zip(profile.height, profile.width, profile.near, profile.far, strict=True)
    place = entry.position
    if mass_kg is not None:
        boulder.entries["density"] = Entry("density", place, Scalar(place, f"{found.density_kg_m3!r} kg/m^3"))
    boulder.entries["profile"] = Entry("profile", place, Sequence(place, [_point(place, *point) for point in points]))
    return Scan(words["file"], found.sha256, standing.up, standing.facing, standing.cut_m)


def _words(node: Node) -> dict[str, str]:
    """Return the words of a scan by key."""
    if not isinstance(node, Mapping) or node.unit is not None:
        raise LeafError(
            [Mistake(node.position, f"must be a block, as in {FORM}; 'sweep stone' lists the ways to stand")]
        )
    mistakes, words = [], {}
    for one in node:
        if one.key not in KEYS:
            message = f"'{shorten(one.key)}' is not a key of a scan ({', '.join(KEYS)}){did_you_mean(one.key, KEYS)}"
            mistakes.append(Mistake(one.position, message))
        elif not isinstance(one.value, Scalar) or not one.value.text.strip():
            mistakes.append(Mistake(one.value.position, f"{one.key} must be one word"))
        else:
            words[one.key] = one.value.text.strip()
    missing = [key for key in KEYS if key != "unit" and key not in node.entries]
    if missing:
        message = f"the scan lacks {', '.join(missing)}, as in {FORM}; 'sweep stone' lists the ways to stand"
        mistakes.append(Mistake(node.position, message))
    if mistakes:
        raise LeafError(mistakes)
    return words


def _point(place: Position, *values: float) -> Mapping:
    """Return a point of a profile: height, width, near and far [m]."""
    names = ("height", "width", "near", "far")
    entries = {
        name: Entry(name, place, Scalar(place, f"{float(value)!r} m"))
        for name, value in zip(names, values, strict=True)
    }
    return Mapping(place, entries)
