"""Logs of boreholes and cones in each format, made from the public descriptions of the formats."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

Pairs = Sequence[tuple[float, object]]
"""Depths [m] with N, or with q_c [MPa]."""


KINDS = ("HEADING", "UNIT", "TYPE")


def quoted(*cells: object) -> str:
    return ",".join('"' + str(cell).replace('"', '""') + '"' for cell in cells)


def group(name: str, columns: Sequence[tuple[str, str, str]], rows: Sequence[Sequence[object]]) -> list[str]:
    """A group of AGS 4; columns are heading, unit and type."""
    heads = [quoted(kind, *values) for kind, values in zip(KINDS, zip(*columns, strict=True), strict=True)]
    return [quoted("GROUP", name), *heads, *(quoted("DATA", *row) for row in rows), ""]


PROJECT = [
    *group("PROJ", [("PROJ_ID", "", "ID"), ("PROJ_NAME", "", "X")], [("1", 'A "made up" site')]),
    *group("TRAN", [("TRAN_AGS", "", "X"), ("TRAN_DLIM", "", "X")], [("4.1", "|")]),
]


def ags_counts(holes: dict[str, Pairs], ratio: object = 60, unit: str = "m", size: float = 1.0) -> str:
    """An AGS 4 file with a group of blow counts; depths are written in a unit of `size` metres."""
    columns = [("LOCA_ID", "", "ID"), ("ISPT_TOP", unit, "2DP"), ("ISPT_NPEN", "mm", "0DP"), ("ISPT_NVAL", "", "0DP")]
    columns += [("ISPT_REP", "", "X"), ("ISPT_ERAT", "%", "0DP"), ("ISPT_REM", "", "X")]
    rows = [(hole, z / size, 450, n, f"N={n}", ratio, "") for hole, pairs in holes.items() for z, n in pairs]
    location = group("LOCA", [("LOCA_ID", "", "ID"), ("LOCA_GL", "m", "2DP")], [(hole, 12.5) for hole in holes])
    return "\r\n".join([*PROJECT, *location, *group("ISPT", columns, rows)])


def ags_cone(holes: dict[str, Pairs], unit: str = "MPa", size: float = 1.0) -> str:
    """An AGS 4 file with a group of a cone; resistances are written in a unit of `size` MPa."""
    columns = [("LOCA_ID", "", "ID"), ("SCPG_TESN", "", "X"), ("SCPT_DPTH", "m", "2DP"), ("SCPT_RES", unit, "3DP")]
    rows = [(hole, 1, z, float(q) / size, 0.02) for hole, pairs in holes.items() for z, q in pairs]
    general = group("SCPG", [("LOCA_ID", "", "ID"), ("SCPG_TESN", "", "X")], [(hole, 1) for hole in holes])
    return "\r\n".join([*PROJECT, *general, *group("SCPT", [*columns, ("SCPT_FRES", "MPa", "4DP")], rows)])


def gef(pairs: Pairs, *, separator: str = "", ending: str = "", void: str = "-9999", depth: str = "") -> str:
    """A GEF file of a cone; `depth` writes depths in a column of their own beside the penetration length."""
    lines = [
        "#GEFID= 1, 1, 0",
        "#PROCEDURECODE= GEF-CPT-Report, 1, 1, 2",
        "#TESTID= CPT 7",
        "#COMPANYID= made up, 1, 31",
    ]
    lines += [
        f"#COLUMN= {4 if depth else 3}",
        "#COLUMNINFO= 1, m, Sondeerlengte, 1",
        "#COLUMNINFO= 2, MPa, Conusweerstand, 2",
    ]
    lines += [
        "#COLUMNINFO= 3, MPa, Plaatselijke wrijving, 3",
        *([f"#COLUMNINFO= 4, {depth}, Diepte, 11"] if depth else []),
    ]
    lines += [f"#COLUMNVOID= {column}, {void}" for column in range(1, 4)]
    lines += [f"#COLUMNSEPARATOR= {separator}"] if separator else []
    lines += [f"#RECORDSEPARATOR= {ending}"] if ending else []
    between = separator or "  "
    rows = []
    for z, q in pairs:
        cells = [f"{z + (0.5 if depth else 0.0):.3f}", f"{q}", "0.02", *([f"{z:.3f}"] if depth else [])]
        rows.append(between.join(cells) + (f"{separator}{ending}" if ending else ""))
    return "\r\n".join([*lines, "#EOH=", *rows, ""])


def bro(pairs: Pairs) -> str:
    """A cone log of the Dutch register, as far as its values go."""
    names = ("penetrationLength", "depth", "elapsedTime", "coneResistance", "localFriction")
    flags = "".join(f"<c:{name}>{'nee' if name == 'elapsedTime' else 'ja'}</c:{name}>" for name in names)
    values = "".join(f"{z + 0.1},{z},-999999,{q},0.02;" for z, q in pairs)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<d:response xmlns:d="urn:d" xmlns:c="urn:c" xmlns:s="urn:s">'
        f"<c:broId>CPT000000000001</c:broId><c:disResult><c:values>1,2;</c:values></c:disResult>"
        f"<c:parameters>{flags}</c:parameters>"
        '<c:cptResult><s:TextEncoding decimalSeparator="." tokenSeparator="," blockSeparator=";"/>'
        f"<c:values>{values}</c:values></c:cptResult></d:response>"
    )


def table(header: str, pairs: Pairs, delimiter: str = ",") -> str:
    return "\n".join([header, *(f"{z}{delimiter}{value}" for z, value in pairs), ""])


def written(folder: Path, name: str, text: str | bytes) -> str:
    """Write a file and return its name."""
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return name
