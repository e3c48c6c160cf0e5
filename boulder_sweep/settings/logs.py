"""Files of an investigation: a table of blow counts or of a cone (CSV, Excel), AGS 4, GEF, and the XML of the BRO.

Each becomes readings of one hole in the units that the file names. `boulder_sweep.settings.soil_readings` makes soil of
them.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from xml.etree import ElementTree

from boulder_sweep.locations import Location
from boulder_sweep.settings.problems import (
    Position,
    Problems,
    check_regular_file,
    content_of,
    refuse,
    shorten,
    unknown_word,
    wrong,
)
from boulder_sweep.settings.soil_readings import CONE, READING_FIELDS, REFUSAL_BLOWS, WEIGHT, Log, LogReading
from boulder_sweep.settings.tables import located, open_table
from boulder_sweep.settings.tree import Scalar
from boulder_sweep.settings.units import UnitError, factor, suffix_unit
from boulder_sweep.settings.values import outside
from boulder_sweep.text import counted

MOST_BYTES = 50_000_000
MOST_READINGS = 200_000
"""Most readings of a hole."""
_SHOWN = 10
"""Most names in a line."""
_UNITS = {"depth": "m", CONE: "MPa"}
_SAMPLES = {"depth": "Depth (m)", "n": "N", CONE: "qc (MPa)"}
_US_SAMPLES = {"depth": "Depth (ft)", CONE: "qc (tsf)"}
_NAMES = {
    "depth": "depth top from depthfrom depthtop topdepth testdepth depthbgl depthbgs depthbelowground",
    "n": "n spt sptn nspt nvalue sptnvalue sptvalue blows blowcount blowcounts sptblows sptblowcount nfield fieldn "
    "uncorrectedn blowsft blowsfoot blowsperft blowsperfoot",
    "n60": "n60 sptn60",
    "n1_60": "n160",
    CONE: "qc coneresistance coneresistanceqc tipresistance conetipresistance qt correctedconeresistance",
    "energy_ratio": "energyratio er energy hammerenergy hammerefficiency",
    "hole": "hole borehole boring bh holeid boreholeid boringid locaid pointid",
}
"""Names of the columns of a table by what they give, in small letters, without signs and units."""
_KEYS = {name: key for key, names in _NAMES.items() for name in names.split()}
_SPELLINGS = {unit.lower(): unit for unit in ("m", "cm", "ft", "in", "MPa", "kPa", "Pa", "tsf", "ksf", "psf", "psi")}
"""Units as they are written by their small letters: real headers are often in capitals."""
_DRIFT_MPA = 1.0
"""How far below 0 a cone may drift."""
_COUNTS = ("n", "n60", "n1_60")
_READINGS = (CONE, *_COUNTS)
_OF_A_COUNT = {"1", "12", "30", "30.5", "300", "305", "0.3", "0.305"}
"""Numbers that the unit of a count may have, blows per 300 mm or 1 ft; others are of another test."""
_INCREMENTS = re.compile(r"\d{1,4}(?:\s*-\s*\d{1,4}){1,3}(?P<over>\s*/.*)?", re.ASCII)
_AGS = {
    "ISPT": {"depth": "ISPT_TOP", "n": "ISPT_NVAL", "energy_ratio": "ISPT_ERAT"},
    "SCPT": {"depth": "SCPT_DPTH", CONE: "SCPT_RES"},
}
_AGS_WATER = {"ISPT": "ISPT_WAT", "SCPG": "SCPG_WAT", "WSTG": "WSTG_DPTH"}
"""Depths of ground water by the group [m]: at a test, under a cone, and as struck."""
_WHOLE_MM = 450.0
"""Penetration of a whole test by AGS, with the seating drive."""
_GEF_LENGTH, _GEF_CONE, _GEF_DEPTH, _GEF_WATER = "1", "2", "11", "14"
"""Numbers of quantities in GEF; the last is a measured variable, the depth of the ground water [m]."""
_BRO_EMPTY = "-999999"


class _Hole:
    """The readings of one hole of a file, and the names of all; without a name the file has only one."""

    def __init__(self, label: str, name: str | None) -> None:
        self.label, self.name = label, name
        self.names: dict[str, None] = {}
        self.readings: dict[str, list[LogReading]] = {}
        self.unused: list[str] = []
        self.water: dict[str, float] = {}

    def add(self, hole: str, key: str, at: Position, depth: str, text: str, ratio: str = "", unit: float = 1.0) -> None:
        """Add a reading that stands at a place; depth in units of so many metres."""
        self.names[hole] = None
        if self.name not in (None, hole) or (self.name is None and len(self.names) > 1):
            return
        kind, line = self.readings.setdefault(key, []), Position(self.label, at.line)
        if len(kind) >= MOST_READINGS:
            raise wrong(line, f"has more than {MOST_READINGS:,} readings of a hole")
        metres = unit * self.number(depth, "depth", line)
        self.check(metres, "depth", line)
        kind.append(LogReading(at, metres, text, ratio))

    def number(self, text: str, key: str, at: Position) -> float:
        """Return a number; NaN for an empty cell."""
        try:
            value = float(text) if text.strip() else math.nan
        except ValueError:
            value = math.inf
        if math.isinf(value) or (math.isnan(value) and text.strip()):
            raise wrong(at, f"{key}: '{shorten(text)}' is not a number")
        return value

    def cone(self, text: str, size: float, at: Position) -> str:
        """Return a resistance in MPa; empty for an empty cell."""
        if not text.strip():
            return ""
        value = size * self.number(text, CONE, at)
        self.check(value if value < -_DRIFT_MPA else max(0.0, value), CONE, at)
        return repr(value)

    def add_water(self, hole: str, text: str) -> None:
        """Keep the least depth of the ground water in a hole; what is no depth is left out."""
        with suppress(ValueError):
            if 0.0 <= float(text) < math.inf:
                self.water[hole] = min(float(text), self.water.get(hole, math.inf))

    def check(self, value: float, key: str, at: Position) -> None:
        """Refuse a value that no reading has; NaN stands for none."""
        if reason := "" if math.isnan(value) else outside(value, READING_FIELDS["cpt"][key]):
            raise wrong(at, f"{key}: {reason}; leave the cell empty where there is no reading")


def read_log(node: Scalar, hole: Scalar | None, folder: Path) -> Log:
    """Return the readings of one hole of a file, by its name or URL as written in the settings.

    The hole is None where the file has only one; relative names begin in the folder. Raise `SettingsError` with every
    mistake, at its line of the file.
    """
    problems = Problems()
    with problems.under(named=node.position):
        path = located(node, folder)
        reader = _READERS.get(path.suffix.lower())
        if reader is None:
            raise wrong(node.position, f"'{shorten(node.text)}' has an unsupported type; use {', '.join(_READERS)}")
        check_regular_file(path, MOST_BYTES, "Keep the hole that is meant")
        found = _Hole(str(path), None if hole is None else hole.text.strip())
        reader(path, found)
    problems.raise_if_any()
    return _log_of(found, node, node if hole is None else hole)


def _log_of(found: _Hole, node: Scalar, hole: Scalar) -> Log:
    """Return what was read, if it is of one hole; a cone counts before the blow counts of the same hole."""
    names = [shorten(name) or "(no name)" for name in found.names]
    shown = names[:_SHOWN] + ["..."] * (len(names) > _SHOWN)
    if found.name is None and len(names) > 1:
        raise wrong(node.position, f"{found.label} has {len(names)} holes; name one as hole: {', '.join(shown)}")
    if names and not found.readings:
        raise wrong(hole.position, unknown_word(hole.text, f"a hole of {found.label} with readings", shown))
    key = CONE if CONE in found.readings else next(iter(found.readings), "")
    given = found.readings.get(key, [])
    readings = sorted((one for one in given if one.text and math.isfinite(one.depth_m)), key=lambda one: one.depth_m)
    if not readings:
        raise wrong(node.position, f"{found.label} has no rows with a depth and a reading")
    unused = [*found.unused, *("blow counts" for other in found.readings if other != key)]
    more = [f"{len(unused) - _SHOWN} more"] * (len(unused) > _SHOWN)
    remarks = [f"not used: {', '.join([shorten(name, 30) for name in unused[:_SHOWN]] + more)}"] if unused else []
    if len(readings) < len(given):
        remarks.append(f"{counted(len(given) - len(readings), 'row')} without a depth or a reading left out")
    name = next(iter(found.names)) if found.name is None else found.name
    return Log(key, tuple(readings), node.text.strip(), shorten(name), tuple(remarks), found.water.get(name))


def _read_table(path: Location, found: _Hole) -> None:
    """Read a table of text or a spreadsheet, with the units in the names of the columns."""
    problems = Problems()
    with open_table(path, 10 * MOST_READINGS, list(_SAMPLES.values()), problems) as table:
        columns: dict[str, int] = {}
        sizes: dict[str, float] = {}
        for index, name in enumerate(table.names):
            key, unit = _column(name)
            if not key or key in columns or (key in _READINGS and set(_READINGS) & set(columns)):
                found.unused += [name] if name else []
                continue
            columns[key], sizes[key] = index, _size(unit, key, table.positions[index])
        key = next((key for key in _READINGS if key in columns), "")
        if not key or "depth" not in columns:
            samples = ", ".join(_SAMPLES.values())
            raise refuse(found.label, f"needs a column of depth and one of N or q_c, such as {samples}", 1, 1)
        for rows in table.chunks():
            cells = {one: table.cells(rows, index) for one, index in columns.items()}
            for one in ("depth", CONE):
                if one in columns:  # with the decimal commas of the table
                    numbers = table.numbers(rows, columns[one], one, _UNITS[one], may_be_empty=True)
                    cells[one] = ["" if math.isnan(value) else repr(float(value)) for value in numbers]
            for at, row in enumerate(rows):
                text, place = cells[key][at].strip(), table.position(row, columns[key])
                text = found.cone(text, sizes[key], place) if key == CONE else count_of(text)
                ratio = cells["energy_ratio"][at].strip() if "energy_ratio" in cells else ""
                ratio += "%" if ratio and sizes["energy_ratio"] < 1.0 and "%" not in ratio else ""
                hole = cells["hole"][at].strip() if "hole" in cells else ""
                found.add(hole, key, place, cells["depth"][at], text, ratio, sizes["depth"])
    problems.raise_if_any()


def _column(name: str) -> tuple[str, str]:
    """Return what a column gives, and its unit; both empty for others."""
    match = re.fullmatch(r"(.*?[^\s(\[])\s*[(\[]([^()\[\]]*)[)\]]\s*", name)
    stem, unit = (match[1], match[2].strip()) if match else (name, "")
    key = _KEYS.get(re.sub(r"[^a-z0-9]", "", stem.lower()), "")
    if not key and match is None:  # depth_m, qc MPa
        first, _, unit = re.sub(r"[\s,;/]+", "_", name.strip()).partition("_")
        key, unit = _KEYS.get(first.lower(), ""), unit.removeprefix("in_")
        key = key if key in _UNITS and suffix_unit(_SPELLINGS.get(unit.lower(), unit), _UNITS[key]) else ""
    if key in _COUNTS and set(re.findall(r"[\d.]+", unit)) - _OF_A_COUNT:
        key = ""
    return key, unit if key else ""


def _size(unit: str, key: str, position: Position) -> float:
    """Return the size of a unit in the unit of the readings."""
    if key not in _UNITS:
        return 0.01 if "%" in unit else 1.0
    plain = re.sub(r"\s*(bgl|bgs|below.*)$", "", unit, flags=re.IGNORECASE)
    try:
        return float(factor(_SPELLINGS.get(plain.lower(), plain), _UNITS[key]))
    except UnitError as error:
        words = str(error) if plain else f"the unit is missing; write {_SAMPLES[key]} or {_US_SAMPLES[key]}"
        raise refuse(position.file, f"{key}: {words}", position.line or 1, position.column) from None


def count_of(text: str) -> str:
    """Return the blows of a count in increments, ``WOH-6-7`` as 13 without the first; anything else as it is."""
    text = re.sub(rf"\b{WEIGHT.pattern}\b(\s*/.*)?", "0", text, flags=re.IGNORECASE)
    match = _INCREMENTS.fullmatch(text)
    if match is None:
        return "" if text in ("-", "–", "—") else text
    blows = [int(part) for part in text.split("/")[0].split("-")]
    if match["over"]:  # the last increment was given up
        return f">{sum(blows[1:])}"
    return str(sum(blows[1:3])) if len(blows) > 2 else text


def _text_of(path: Location) -> str:
    """Return the text of a file in UTF-8 or an encoding of one byte: no number needs more than ASCII."""
    data = content_of(path, MOST_BYTES)
    if b"\x00" in data:
        raise refuse(str(path), "is not a text file")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _read_ags(path: Location, found: _Hole) -> None:
    """Read blow counts (ISPT) and cones (SCPT) of AGS 4: quoted CSV in groups, each with headings and units."""
    label, text = found.label, _text_of(path)
    if '"**' in text[:100_000]:
        raise refuse(label, "is AGS 3; save it as AGS 4")
    group, names, sizes = "", [""], dict.fromkeys(_UNITS, 1.0)
    rows = csv.reader(io.StringIO(text, newline=""))
    try:
        for cells in rows:
            kind, line = cells[0].strip() if cells else "", rows.line_num
            if kind == "DATA" and group in _AGS_WATER:
                row = {name: cell.strip() for name, cell in zip(names, cells, strict=False)}
                found.add_water(row.get("LOCA_ID", ""), row.get(_AGS_WATER[group], ""))
            if kind == "GROUP":
                group, names, sizes = "".join(cells[1:2]).strip(), [], dict.fromkeys(_UNITS, 1.0)
            elif kind == "HEADING":
                names = [name.strip() for name in cells]
            elif group not in _AGS:
                continue
            elif kind in ("UNIT", "DATA") and len(cells) != len(names):
                raise refuse(label, f"has {len(cells)} cells; the headings of {group} are {len(names)}", line)
            elif kind == "UNIT":
                units = dict(zip(names, cells, strict=True))
                sizes = {
                    key: _size(units.get(name, "").strip() or _UNITS[key], key, Position(label, line))
                    for key, name in _AGS[group].items()
                    if key in _UNITS
                }
            elif kind == "DATA":
                row = {name: cell.strip() for name, cell in zip(names, cells, strict=True)}
                _take_ags(found, group, row, sizes, Position(label, line))
    except csv.Error:
        raise refuse(label, "cannot be read as AGS 4; is a quotation mark not closed?", rows.line_num) from None


def _take_ags(found: _Hole, group: str, row: dict[str, str], sizes: dict[str, float], at: Position) -> None:
    """Take one row of a group."""
    cells = {key: row.get(name, "") for key, name in _AGS[group].items()}
    hole, unit = row.get("LOCA_ID", ""), sizes["depth"]
    if group == "SCPT":
        found.add(hole, CONE, at, cells["depth"], found.cone(cells[CONE], sizes[CONE], at), unit=unit)
        return
    text, reported = cells["n"], row.get("ISPT_REP", "")
    given_up = re.findall(r"(\d{1,4})\s*(?:/|for)\s*\d+\s*mm", reported, re.ASCII)
    if found.number(row.get("ISPT_NPEN", ""), "ISPT_NPEN", at) < _WHOLE_MM or (given_up and not text):
        at_most = min(int(text[:9]), REFUSAL_BLOWS) if text.isdecimal() else REFUSAL_BLOWS  # more is extrapolated
        text = f">{row.get('ISPT_MAIN') or ''.join(given_up[-1:]) or at_most}"
    elif not text and (named := re.search(r"N\s*([=>])\s*(\d{1,4})", reported, re.ASCII)):
        text = named[2] if named[1] == "=" else f">{named[2]}"
    ratio = cells["energy_ratio"] and f"{cells['energy_ratio']}%"
    found.add(hole, "n", at, cells["depth"], count_of(text), ratio, unit)


def _read_gef(path: Location, found: _Hole) -> None:
    """Read a cone of GEF: lines ``#KEY= ...`` up to ``#EOH=``, then columns."""
    label, text = found.label, _text_of(path)
    lines = text.splitlines()
    at: dict[str, int] = {}
    sizes: dict[int, float] = {}
    voids: dict[str, float] = {}
    hole, separator, ending, end, water = "", None, "", 0, ""
    for end, line in enumerate(lines, 1):
        match = re.fullmatch(r"\s*#\s*(\w+)\s*=\s*(.*?)\s*", line)
        key, rest = (match[1].upper(), match[2]) if match else ("", "")
        values = [value.strip() for value in rest.split(",")]
        if key == "COLUMNINFO" and len(values) > 3 and values[0].isascii() and values[0].isdecimal():
            column = int(values[0][:9]) - 1
            at.setdefault(values[-1], column)
            if values[-1] in (_GEF_LENGTH, _GEF_CONE, _GEF_DEPTH):
                kind = CONE if values[-1] == _GEF_CONE else "depth"
                sizes[column] = _size(values[1], kind, Position(label, end))
        elif key == "COLUMNVOID" and len(values) > 1:
            voids[values[0]] = found.number(values[1], "COLUMNVOID", Position(label, end))
        elif key == "MEASUREMENTVAR" and values[0] == _GEF_WATER:
            water = "".join(values[1:2])
        elif key == "TESTID":
            hole = rest
        elif key == "COLUMNSEPARATOR":
            separator = rest or None
        elif key == "RECORDSEPARATOR":
            ending = rest
        elif key == "EOH":
            break
    else:
        raise refuse(label, "is not a GEF file: its header has no #EOH=")
    found.add_water(hole, water)
    depth, cone = at.get(_GEF_DEPTH, at.get(_GEF_LENGTH)), at.get(_GEF_CONE)
    if depth is None or cone is None or min(depth, cone) < 0:
        raise refuse(label, "has no columns (#COLUMNINFO) of depth and cone resistance, quantities 1 and 2")
    for number, line in enumerate(lines[end:], end + 1):
        place = Position(label, number)
        record = line.replace(ending, "") if ending else line
        if not record.strip():
            continue
        cells = [cell.strip() for cell in record.split(separator)]
        if len(cells) <= max(at.values()):
            raise refuse(label, f"has {len(cells)} cells; the header names more", number)
        z, q = (
            "" if found.number(cells[k], key, place) == voids.get(str(k + 1), math.nan) else cells[k]
            for k, key in ((depth, "depth"), (cone, CONE))
        )
        found.add(hole, CONE, place, z, found.cone(q, sizes[cone], place), unit=sizes[depth])


def _by_name(root: ElementTree.Element) -> dict[str, ElementTree.Element]:
    """Return the first element of each name, without namespaces."""
    return {part.tag.rpartition("}")[2]: part for part in reversed(list(root.iter())) if isinstance(part.tag, str)}


def _read_bro(path: Location, found: _Hole) -> None:
    """Read a cone of the Dutch register (BRO-XML): flags of the measured quantities, and their values as one text."""
    label, text = found.label, _text_of(path)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise refuse(label, "has definitions of its own (DOCTYPE), which no file of the BRO has")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError):
        raise refuse(label, "cannot be read as XML") from None
    parts = _by_name(root)
    result = _by_name(parts["cptResult"]) if "cptResult" in parts else {}  # dissipation tests have values, too
    flags, values, way = parts.get("parameters"), result.get("values"), result.get("TextEncoding")
    if flags is None or values is None or way is None or not values.text:
        raise refuse(label, "is no cone log of the BRO: parameters, values or their encoding are missing")
    measured = [flag.tag.rpartition("}")[2] for flag in flags]
    taken = [flag.tag.rpartition("}")[2] for flag in flags if (flag.text or "").strip() in ("ja", "true")]
    depth = "depth" if "depth" in taken else "penetrationLength"
    if not {depth, "coneResistance"} <= set(taken):
        raise refuse(label, "has no depth, or no cone resistance")
    place = Position(label, 1)
    hole = "".join(parts["broId"].itertext()).strip() if "broId" in parts else ""
    for record in values.text.strip().split(way.get("blockSeparator") or ";"):
        cells = [cell.strip() for cell in record.split(way.get("tokenSeparator") or ",")]
        if cells == [""]:
            continue
        if len(cells) != len(measured):
            raise refuse(label, f"has {len(cells)} values in a row; {len(measured)} are declared", 1)
        row = dict(zip(measured, ("" if cell == _BRO_EMPTY else cell for cell in cells), strict=True))
        found.add(hole, CONE, place, row[depth], found.cone(row["coneResistance"], 1.0, place))


_READERS: dict[str, Callable[[Location, _Hole], None]] = {
    ".csv": _read_table,
    ".xlsx": _read_table,
    ".ags": _read_ags,
    ".gef": _read_gef,
    ".xml": _read_bro,
}
"""Readers by the end of the file's name."""
