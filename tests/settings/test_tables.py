"""Lists of designs and measured curves from files: right, wrong, and made to do harm."""

from __future__ import annotations

import io
import os
import random
import re
import threading
import zipfile
from decimal import Decimal
from pathlib import Path

import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from openpyxl import Workbook

from boulder_sweep.crash_tests.measured import PULSE_SIGNALS, read_history
from boulder_sweep.locations import location_of, put
from boulder_sweep.settings import SettingsError, load, load_text
from boulder_sweep.settings.fields import INPUTS
from tests.counting import calls_of
from tests.waiting import HANG_GUARD_S

HEADER = "boulder_length_m,boulder_width_m,boulder_height_m,embedment_depth_m\n"
ROWS = "0.762,1.016,2.2,1.2\n1.65,1.68,3.44,2.03\n"
GRID = """\
table: {table}
boulder: {{density: 2600}}
soil: {{density: 1859.9, friction_angle: 43.2, subgrade_reaction: 95}}
vehicle: {{mass: 6800, speed: 13.4, spring: 3103.3e3, damper: 138.91e3}}
"""


@pytest.fixture
def load_table(tmp_path):
    def load_table(content, name="designs.csv", grid=GRID):
        data = content.encode() if isinstance(content, str) else content
        if data is not None:
            (tmp_path / name).write_bytes(data)
        (tmp_path / "grid.yaml").write_text(grid.format(table=name))
        return load(tmp_path / "grid.yaml")

    return load_table


@pytest.fixture
def messages_of(load_table, tmp_path):
    def messages_of(*args, **kwargs):
        with pytest.raises(SettingsError) as caught:
            load_table(*args, **kwargs)
        return [str(problem).replace(f"{tmp_path}/", "") for problem in caught.value.problems]

    return messages_of


def _column(sweep, name):
    return sweep.block(0, sweep.n_designs).columns[name].to_numpy().tolist()


def test_rows_in_the_order_of_the_table_with_the_rest_from_the_file(load_table):
    sweep = load_table(HEADER + ROWS)
    assert sweep.n_designs == 2
    assert sweep.axes == ()
    assert _column(sweep, "boulder_height_m") == [2.2, 3.44]
    assert _column(sweep, "embedment_depth_m") == [1.2, 2.03]
    assert _column(sweep, "boulder_density_kg_m3") == [2600.0, 2600.0]
    assert _column(sweep, "hood_height_m") == [1.4, 1.4]
    assert _column(sweep, "impact_height_m") == [0.5 * ((2.2 - 1.2) + 0.5), 0.5 * (min(3.44 - 2.03, 1.4) + 0.5)]
    assert sweep.resolved()["order"] == "table"
    assert sweep.resolved()["inputs"]["boulder_width_m"] == [1.016, 1.68]


@pytest.mark.parametrize(
    "change",
    [
        lambda text: "# who, when\n" + text + "\n\n# end\n",
        lambda text: "\n" + text.replace("\n", "\r\n"),
        lambda text: text.replace(",", ";"),
        lambda text: text.replace(",", "\t"),
        lambda text: text.replace(",", " , "),
        lambda text: text.replace("0.762", '"0.762"'),
        lambda text: text.replace("0.762", "7.62e-1"),
        lambda text: "\ufeff" + text,
        lambda text: text.rstrip("\n"),
    ],
)
def test_csv_in_the_forms_that_programs_write(load_table, change):
    assert _column(load_table(change(HEADER + ROWS)), "boulder_length_m") == [0.762, 1.65]


def test_embedment_ratio_and_impact_height_may_be_columns(load_table):
    sweep = load_table(
        "boulder_length_m,boulder_width_m,boulder_height_m,embedment_ratio,impact_height_m\n1,1,2,0.5,0.7\n"
    )
    assert _column(sweep, "embedment_depth_m") == [1.0]
    assert _column(sweep, "impact_height_m") == [0.7]


def test_impossible_rows_stay_with_their_reason(load_table):
    sweep = load_table(HEADER + "1,1,2,1\n1,1,2,2\n1,1,2,3\n")
    reasons = sweep.block(0, 3).reasons
    assert [reasons[row] for row in range(3)] == ["", *["embedment depth is not less than the boulder's height"] * 2]


def test_cells_are_reported_with_line_and_column_all_at_once(messages_of):
    text = HEADER + '0.762,x,2.2,1.2\n1.65,1.68,nan,\n1.65,-1,3.44,2.03\n1,2\n1.65 m,1,"3,44",1\n1_0,1,1,010\n'
    messages = messages_of(text)
    starts = [
        "designs.csv:2:7: boulder_width_m: 'x' is not a number",
        "designs.csv:3:11: boulder_height_m: 'nan' is not a finite number",
        "designs.csv:3:15: embedment_depth_m: is empty",
        "designs.csv:4:6: boulder_width_m: -1 m is outside the admitted range of 0.01 to 20 m",
        "designs.csv:5:1: has 2 cells; the first line has 4",
        "designs.csv:6: boulder_height_m: '3,44' is not a plain number; write 3.44",
        "designs.csv:6: boulder_length_m: '1.65 m' is not a plain number; a unit belongs in the column's name",
        "designs.csv:7:1: boulder_length_m: '1_0' is not a plain number",
        "designs.csv:7:9: embedment_depth_m: '010' begins with a zero",
    ]
    assert len(messages) == len(starts)
    for start in starts:
        assert any(message.startswith(start) for message in messages), start


def test_the_header_is_checked(messages_of):
    text = "design_id,boulder_lenght_m,boulder_width_m,boulder_width_m,verdict,,boulder_height_m\n"
    messages = messages_of(text + "0,1,1,1,pass,2,1\n")
    assert [message.split(" ")[0] for message in messages] == [
        "designs.csv:1:1:",
        "designs.csv:1:11:",
        "designs.csv:1:44:",
        "designs.csv:1:60:",
        "designs.csv:1:68:",
    ]
    assert "numbered in their order" in messages[0]
    assert "did you mean boulder_length_m?" in messages[1]
    assert "appears twice" in messages[2]
    assert "outcome of a run" in messages[3]


def test_commas_that_begin_cells_are_counted(messages_of):
    (*lines, rest) = messages_of(HEADER + 100 * ROWS.replace(".", ","))
    assert len(lines) == 5
    assert "has 8 cells; the first line has 4 (a comma begins a cell: write 15000 for 15,000" in lines[0]
    assert rest == "designs.csv:201: and 195 more lines like these"


@pytest.mark.parametrize("sign", [";", "\t"])
@pytest.mark.parametrize(
    ("masses", "expected"),
    [
        (["6800,5", "7000"], [6800.5, 7000.0]),
        (["6,8005e3", "7000"], [6800.5, 7000.0]),
        (["0,680e4", "7,000E+3"], [6800.0, 7000.0]),
        ([" 6800,25 ", '"7000,5"'], [6800.25, 7000.5]),
        (["6800.5", "7000"], [6800.5, 7000.0]),
        (["6800,5", "15,000"], [6800.5, 15.0]),
        (["15,000", "7000"], "3:9: '15,000' may be 15000 or 15.000, and no other number tells; write the numbers"),
        (["15,000", "7000.5"], "3:9: '15,000' has a comma, and '7000.5' in line 4 a point; write all numbers with"),
        (["6800,5", "15.000"], "3:9: '6800,5' has a comma, and '15.000' in line 4 a point; write all numbers with"),
        (["1,500,000", "7000"], "3:9: vehicle_mass_kg: '1,500,000' is not a plain number; write 1500000"),
        (["1.500,5", "7000"], "3:9: vehicle_mass_kg: '1.500,5' is not a plain number; write 1500.5"),
    ],
)
def test_decimal_commas_where_a_comma_separates_no_cells(load_table, messages_of, sign, masses, expected):
    table = HEADER.replace("\n", ",vehicle_mass_kg\n").replace(",", sign)
    table = "# from a spreadsheet\n" + table + "".join(sign.join(["1", "1", "2", "1", mass]) + "\n" for mass in masses)
    grid = GRID.replace("mass: 6800, ", "")
    if isinstance(expected, str):
        assert messages_of(table, grid=grid)[0].startswith(f"designs.csv:{expected}")
    else:
        assert _column(load_table(table, grid=grid), "vehicle_mass_kg") == expected


@pytest.mark.parametrize(
    ("text", "heights"),
    [
        ("boulder_height_m,embedment_depth_m\n2.6,1.8\n3.0,2.0\n,\n,\n", [2.6, 3.0]),
        ("boulder_height_m,embedment_depth_m,\n2.6,1.8,\n3.0,2.0,\n", [2.6, 3.0]),
        ("boulder_height_m,embedment_depth_m,,,\n2.6,1.8,,,\n,,,,\n3.0,2.0,,,\n", [2.6, 3.0]),
        ("boulder_height_m,embedment_depth_m\n2.6,1.8,,\n , \n3.0,2.0, \n", [2.6, 3.0]),
        ('boulder_height_m,embedment_depth_m\n2.6,1.8\n"",""\n3.0,2.0\n', [2.6, 3.0]),
        (",,\nboulder_height_m,embedment_depth_m\n2.6,1.8\n", [2.6]),
        (",boulder_height_m,embedment_depth_m\n0,2.6,1.8\n1,3.0,2.0\n", [2.6, 3.0]),
        (",boulder_height_m,embedment_depth_m\n3,2.6,1.8\n17,3.0,2.0\n", [2.6, 3.0]),
        (";boulder_height_m;embedment_depth_m\n0;2,6;1,8\n1;3,0;2,0\n", [2.6, 3.0]),
        ("Unnamed: 0,boulder_height_m,embedment_depth_m\n0,2.6,1.8\n1,3.0,2.0\n", [2.6, 3.0]),
    ],
)
def test_what_spreadsheets_and_pandas_write_around_the_numbers(load_table, text, heights):
    sweep = load_table(text, grid=GRID.replace("boulder: {{", "boulder: {{length: 1.65, width: 1.68, "))
    assert _column(sweep, "boulder_height_m") == heights
    assert sweep.block(0, 1).labels == {}


@pytest.mark.parametrize("numbers", [(0, 0), (2, 1), (1.5, 2), ("a", "b"), (-1, 0)])
def test_a_first_column_without_a_name_that_does_not_count(messages_of, numbers):
    table = f",{HEADER}{numbers[0]},1,1,2,1\n{numbers[1]},1,1,2,1\n"
    (message,) = messages_of(table)
    assert message.startswith("designs.csv:1:1: the first column: has no name, and does not count the rows; give it")


def test_a_table_without_names_says_which_line_is_wanted(messages_of):
    (message,) = messages_of("1;1;2,2;1,2\n1;1;2;1\n")
    line = "boulder_length_m;boulder_width_m;boulder_height_m;boulder_density_kg_m3"
    assert message.startswith(
        f"designs.csv:1:1: table: the first line holds numbers; write a line of names above it, such as {line};"
    )


def test_mistakes_of_one_kind_are_counted(messages_of):
    (*cells, rest) = messages_of(HEADER + "x,1,2,1\n" * 50)
    assert len(cells) == 5
    assert rest == "designs.csv:51: boulder_length_m: and 45 more cells like these"


@pytest.mark.parametrize(
    ("name", "value", "column", "expected"),
    [
        ("boulder_length_ft", "5.5", "boulder_length_m", 1.6764),
        ("Width [ft]", "5", "boulder_width_m", 1.524),
        ("Mass (t)", "15.2", "boulder_mass_kg", 15200.0),
        ("boulder_density_pcf", "162", "boulder_density_kg_m3", 162 * 0.45359237 / 0.3048**3),
        ("boulder_density_lb_ft3", "162", "boulder_density_kg_m3", 162 * 0.45359237 / 0.3048**3),
        ("soil_density_kN_m3", "18.2", "soil_density_kg_m3", 18200 / 9.80665),
        ("friction_angle_rad", "0.7", "friction_angle_deg", np.degrees(0.7)),
        ("subgrade_reaction_pci", "350", "subgrade_reaction_MN_m3", 350 * 4.4482216152605 / 0.0254**3 / 1e6),
        ("vehicle_mass_lb", "15000", "vehicle_mass_kg", 15000 * 0.45359237),
        ("vehicle_mass_short_ton", "7.5", "vehicle_mass_kg", 15000 * 0.45359237),
        ("impact_speed_mph", "30", "impact_speed_m_s", 13.4112),
        ("vehicle_spring_kN_m", "3103.3", "vehicle_spring_N_m", 3103300.0),
        ("vehicle_spring_lb_in", "17720", "vehicle_spring_N_m", 17720 * 4.4482216152605 / 0.0254),
        ("vehicle_damper_kN_s_m", "138.91", "vehicle_damper_N_s_m", 138910.0),
        ("embedment_ratio_percent", "55", "embedment_depth_m", 0.55 * 3.0),
    ],
)
def test_a_column_may_be_in_any_unit_that_fits(load_table, name, value, column, expected):
    given = {"boulder_length_m": "1.5", "boulder_width_m": "1.5", "boulder_height_m": "3", "embedment_depth_m": "1.5"}
    given.pop(column, None)
    given[name] = value
    grid = GRID
    section, _, key = next(f.path.partition(".") for f in INPUTS if f.name == column)
    if section != "site":
        grid = re.sub(rf"({section}: .*?)(, |{{{{){key}: [^,}}]*,? ?", r"\1\2", grid)
    sweep = load_table(f"{','.join(given)}\n{','.join(given.values())}\n", grid=grid)
    assert _column(sweep, column) == pytest.approx([expected], rel=1e-15)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("Length (m)", "gives the same as column boulder_length_m"),
        ("mass t", "did you mean boulder_mass_t?"),
        ("Width (kg)", "is not an input"),
        ("boulder_lenght_ft", "did you mean boulder_length_ft?"),
        ("boulder_lenght_m", "did you mean boulder_length_m?"),
        ("impact_spede_mph", "did you mean impact_speed_mph?"),
        ("boulder_length", "the unit is missing at the end of the name, such as boulder_length_m"),
        ("boulder_length_kg", "did you mean boulder_length, with its unit at the end?"),
        ("beta", "did you mean subgrade_reaction, with its unit at the end?"),
        ("bumper_hieght_ft", "did you mean bumper_height_ft?"),
        ("boulder_length_ft", "gives the same as column boulder_length_m"),
        ("price", "is not an input (inputs: boulder_length, boulder_width"),
        ("<script>", "may hold letters, digits"),
        ("\x1b[31m", "may hold letters, digits"),
    ],
)
def test_columns_of_numbers_that_are_not_used(messages_of, name, words):
    messages = messages_of(HEADER.replace("\n", f",{name}\n") + "1,1,2,1,7\n")
    assert words in messages[0]
    assert not any(" _m?" in message for message in messages)


@pytest.mark.parametrize("name", ["rock", "boulder_rock", "Rock type"])
def test_a_column_of_rock_is_refused_unless_there_is_one_of_density(messages_of, load_table, name):
    rows = f"{HEADER[:-1]},{name}\n1,1,2,1,granite\n1,1,2,1,limestone\n"
    (message,) = messages_of(rows)
    assert message.startswith(f"designs.csv:1:{len(HEADER) + 1}: {name}: is not read")
    assert message.endswith("write a list for each kind of rock, or add a column boulder_density_kg_m3")
    dense = rows.replace(f",{name}", f",{name},boulder_density_pcf").replace("ite", "ite,165").replace("one", "one,159")
    assert [*load_table(dense, grid=GRID.replace("density: 2600", "", 1)).table.labels] == [name]


def test_text_is_carried_along(load_table):
    header = "boulder_id,Block name," + HEADER.replace("\n", ",remark\n")
    sweep = load_table(header + "7,Ada \x1b[31m,1,1,2,1,first\n8,,1,1,2.5,1,\n9,Ada \x1b[31m,1,1,3,1,first\n")
    block = sweep.block(1, 3)
    labels = {name: [label.words[code] for code in label.codes] for name, label in block.labels.items()}
    assert labels == {"boulder_id": ["8", "9"], "Block name": ["", "Ada ?[31m"], "remark": ["", "first"]}
    assert sweep.resolved()["labels"]["boulder_id"] == ["7", "8", "9"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "is empty"),
        ("# only\n", "is empty"),
        (HEADER, "no rows below the column names"),
        ("boulder_id,remark\na,b\n", "has no column that is an input"),
        (HEADER.encode("utf-16"), "not UTF-8"),
        (HEADER + "1,\x00,1,1\n", "designs.csv:2"),
        (b"\xff\xd8\xff\xe0", "not UTF-8"),
        (HEADER + "1,1,1,1\n" * 3 + '1,"' + "1" * 200_000, "CSV"),
    ],
)
def test_files_that_are_no_tables(messages_of, content, words):
    assert any(words in message for message in messages_of(content))


@pytest.mark.parametrize(
    ("content", "name", "message"),
    [
        *(
            (HEADER + ROWS, name, "has an unsupported type; use one of .csv")
            for name in ("designs.xls", "a", ".csv.txt")
        ),
        (None, "no.csv", "no.csv: there is no such file"),
        (None, "large.csv", "large.csv: has 3000.0 MB; at most 500 MB is read"),  # before it is read
    ],
)
def test_files_that_are_not_opened(messages_of, tmp_path, content, name, message):
    with (tmp_path / "large.csv").open("wb") as stream:
        stream.truncate(3_000_000_000)
    (found,) = messages_of(content, name)
    assert found.startswith("grid.yaml:1:8: table: ")
    assert message in found


MISSING = "is required and missing; give it here or as column boulder_height_m of designs.csv"
ONE_VALUE = "must be one value beside a table; lists and ranges are axes of a grid"
BOTH = "give embedment_ratio or embedment_depth, not both"
GIVEN = "boulder.height: is given here and as column boulder_height_m of the table"


@pytest.mark.parametrize(
    ("content", "old", "new", "messages"),
    [
        (
            HEADER + ROWS,
            "2600}}\n",
            "2600, height: 3}}\nsite: {{embedment_ratio: 0.5}}\n",
            [f"2:26: {GIVEN}", f"3:1: site.embedment_depth: {BOTH}"],
        ),
        (
            *(HEADER + ROWS, "13.4", "[25, 30] mph"),
            [f"4:30: vehicle.speed: {ONE_VALUE}: ask once for each value, --set vehicle.speed='25 mph'"],
        ),
        (
            "boulder_length_m,boulder_width_m,embedment_depth_m\n1,1,1\n",
            *("", "", [f"2:1: boulder.height: {MISSING}"]),
        ),
    ],
)
def test_table_and_file_give_every_input_once(messages_of, content, old, new, messages):
    found = messages_of(content, grid=GRID.replace(old, new, 1))
    assert len(found) == len(messages)
    for one, message in zip(found, messages, strict=True):
        assert one.startswith(f"grid.yaml:{message}")


def test_masses_that_are_all_too_large_have_their_place_in_the_list(messages_of):
    text = "boulder_length_m,boulder_width_m,boulder_height_m,boulder_mass_t,embedment_depth_m\n"
    (message,) = messages_of(f"{text}1.5,1.6,2.5,16000,1.2\n1.5,1.6,2.5,12700,1.2\n")
    assert message.startswith("designs.csv:3: boulder_mass_t: 1.27e+07 kg is 814.10 times the mass of a solid box")
    assert message.endswith("; a thousandth of it fits: is it in kg and not in t, or in lb and not in kip?")
    (message,) = messages_of(f"{text}1.5,1.6,2.5,160,1.2\n")
    assert "thousandth" not in message


def test_a_relative_name_begins_at_the_file_and_behind_set_at_the_working_directory(tmp_path, monkeypatch, load_table):
    load_table(HEADER + ROWS)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert load(tmp_path / "grid.yaml").n_designs == 2
    (elsewhere / "one.csv").write_text(HEADER + "1,1,2,1\n")
    assert load(tmp_path / "grid.yaml", ["table=one.csv"]).n_designs == 1


@pytest.fixture
def write_parquet(tmp_path):
    return lambda **columns: (tmp_path / "designs.parquet").write_bytes(parquet(**columns))


def test_decimals_of_a_database_and_the_index_of_pandas(load_table, write_parquet):
    kinds = [pa.decimal128(2, 1), pa.decimal128(18, 3), pa.decimal256(40, 2), pa.decimal128(5, 0)]
    values = [["1.5", "2.0"], ["1.25", "2"], ["3.44", "4"], ["2", "3"]]
    columns = {
        name: pa.array([Decimal(value) for value in own], type=kind)
        for name, own, kind in zip(HEADER.strip().split(","), values, kinds, strict=True)
    }
    write_parquet(**columns, __index_level_0__=[4, 9])
    sweep = load_table(None, "designs.parquet")
    assert [_column(sweep, name) for name in columns] == [[float(value) for value in own] for own in values]
    assert sweep.block(0, 1).labels == {}


def test_mistakes_in_parquet(write_parquet, messages_of):
    write_parquet(
        boulder_length_m=[1.0, -2.0],
        boulder_width_m=["1", "2"],
        boulder_height_m=[3.0, None],
        embedment_depth_m=[float("inf"), float("nan")],
        margin=[1.0, 1.0],
    )
    messages = messages_of(None, "designs.parquet")
    assert len(messages) == 6
    for start in (
        "designs.parquet: margin: is an outcome of a run",
        "designs.parquet: boulder_length_m: row 2: -2 m is outside the admitted range of 0.01 to 20 m",
        "designs.parquet: boulder_width_m: holds text, not numbers",
        "designs.parquet: boulder_height_m: has 1 empty cells",
        *(f"designs.parquet: embedment_depth_m: row {row}: is not a finite number" for row in (1, 2)),
    ):
        assert any(message.startswith(start) for message in messages), start


@pytest.mark.parametrize("content", [b"", b"PAR1", b"PAR1" + bytes(100) + b"PAR1", b"PK", b"x" * 1000])
@pytest.mark.parametrize(("name", "words"), [("designs.parquet", "Parquet"), ("designs.xlsx", "a spreadsheet")])
def test_files_that_are_neither_parquet_nor_spreadsheets(messages_of, content, name, words):
    (message,) = messages_of(content, name)
    assert f"cannot be read as {words}" in message


def test_a_long_table_stays_columns(load_table):
    rows = 30_000
    rng = np.random.default_rng(5)
    heights = rng.uniform(1.5, 4, rows)
    lines = "".join(f"1.5,{1 + k % 3},{height!r},1\n" for k, height in enumerate(heights.tolist()))
    sweep = load_table(HEADER + lines)
    block = sweep.block(20_000, 20_100)
    assert block.columns["boulder_height_m"].to_numpy().tolist() == heights[20_000:20_100].tolist()
    assert len(block.columns["boulder_width_m"].values) == 3


@pytest.fixture
def write_xlsx(tmp_path):
    def write_xlsx(*rows):
        book = openpyxl.Workbook()
        for row in rows:
            book.active.append(row)
        book.create_sheet("second").append(["not read"])
        book.save(tmp_path / "designs.xlsx")

    return write_xlsx


def test_a_spreadsheet(load_table, write_xlsx):
    names = ["Block", "boulder_length_ft", "boulder_width_m", "boulder_height_m", "embedment_depth_m", None]
    write_xlsx(names, ["A 1", 5.5, 1, 3.44, 2.03], [], ["A 2", "6", 1.2, 3, 1.5, None], [None, 5, 1, 3, 1.5])
    sweep = load_table(None, "designs.xlsx")
    assert _column(sweep, "boulder_length_m") == pytest.approx([1.6764, 1.8288, 1.524])
    assert _column(sweep, "boulder_height_m") == [3.44, 3.0, 3.0]
    label = sweep.block(0, 3).labels["Block"]
    assert [label.words[code] for code in label.codes] == ["A 1", "A 2", ""]


@pytest.mark.parametrize(
    ("rows", "place"),
    [
        ([[1, 1, 2, "=C2*0.5"]], "2:4"),
        ([[1, 1, 2, 1], [None, None, None, None], [1, 1, "=2*D2", 1]], "4:3"),
        ([["=1+1", "=1+1", "=2*2", "=1+0"]], "2:1"),
    ],
)
def test_formulas_without_values(write_xlsx, messages_of, rows, place):
    write_xlsx(HEADER.strip().split(","), *rows)
    (message,) = messages_of(None, "designs.xlsx")
    words = "has formulas without values: open and save it once in a spreadsheet program"
    assert message == f"designs.xlsx:{place}: table: {words}"


def test_formulas_with_values(write_xlsx, load_table, tmp_path):
    """As a spreadsheet program saves them; a text of no letters is a value, too."""
    write_xlsx([None, *HEADER.strip().split(","), "remark"], [0, 1, 1, 2, "=D2*0.5", '=""'])
    file = tmp_path / "designs.xlsx"
    with zipfile.ZipFile(file) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    sheet = "xl/worksheets/sheet1.xml"
    text = re.sub(rb'r="E2"><f>(.*?)</f><v ?/>', rb'r="E2"><f>\1</f><v>1.25</v>', parts[sheet])
    text = re.sub(rb'r="F2"><f>(.*?)</f><v ?/>', rb'r="F2" t="str"><f>\1</f><v></v>', text)
    assert text.count(b"</v>") > parts[sheet].count(b"</v>") + 1
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, text if name == sheet else content)
    sweep = load_table(None, "designs.xlsx")
    assert _column(sweep, "embedment_depth_m") == [1.25]


def test_mistakes_in_a_spreadsheet(write_xlsx, messages_of):
    write_xlsx(HEADER.strip().split(","), [1, 1, 2, 1], [1, "x", 2, None], [1, 1, 2, 1, 7], [1, 1, 200, 1])
    messages = messages_of(None, "designs.xlsx")
    assert [message.split(": ")[0] for message in messages] == [
        f"designs.xlsx:{position}" for position in ("3:2", "3:4", "4:1", "5:3")
    ]
    assert "has 5 cells; the first line has 4" in messages[2]


def test_a_spreadsheet_that_unpacks_to_too_much(messages_of, tmp_path, monkeypatch):
    monkeypatch.setattr("boulder_sweep.settings.tables.MAX_UNPACKED_BYTES", 1_000_000)
    with zipfile.ZipFile(tmp_path / "designs.xlsx", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/workbook.xml", bytes(1_000_001))
    (message,) = messages_of(None, "designs.xlsx")
    assert "once unpacked; save it as CSV" in message


@pytest.mark.parametrize(("cell", "row"), [("XFD1048576", 1221), ("CV300000", 200001)])
def test_a_single_cell_far_out(load_table, messages_of, tmp_path, cell, row):
    book = openpyxl.Workbook()
    book.active.append(["boulder_height_m"])
    book.active[cell] = 1.0
    book.save(tmp_path / "designs.xlsx")
    (message,) = messages_of(None, "designs.xlsx")
    assert (
        message == f"designs.xlsx:{row}:1: table: has more than 20,000,000 cells, with the empty ones; save it as CSV"
    )


def test_an_empty_spreadsheet(write_xlsx, messages_of):
    write_xlsx()
    assert "is empty; the first line" in messages_of(None, "designs.xlsx")[0]
    write_xlsx(HEADER.strip().split(","))
    assert "no rows below the column names" in messages_of(None, "designs.xlsx")[0]


@pytest.mark.parametrize("suffix", ["csv", "xlsx", "parquet"])
def test_a_table_may_be_named_by_a_url(load_table, write_parquet, write_xlsx, tmp_path, suffix):
    names, *rows = [line.split(",") for line in (HEADER + ROWS).splitlines()]
    numbers = [list(map(float, row)) for row in rows]
    (tmp_path / "designs.csv").write_text(HEADER + ROWS)
    write_parquet(**dict(zip(names, map(list, zip(*numbers, strict=True)), strict=True)))
    write_xlsx(names, *numbers)
    put(location_of(f"memory://tables/designs.{suffix}"), (tmp_path / f"designs.{suffix}").read_bytes())
    sweep, same = (load_table(None, f"{folder}designs.{suffix}") for folder in ("memory://tables/", ""))
    assert _column(sweep, "boulder_height_m") == [2.2, 3.44]
    assert sweep.resolved() == same.resolved()


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("memory://tables/none.csv", "memory://tables/none.csv: there is no such file"),
        ("s3://KEY:SECRET@bucket/designs.csv", "s3://bucket/designs.csv: the URL was given with a user name"),
        ("memory://tables/designs.doc", "has an unsupported type"),
    ],
)
def test_a_url_that_gives_no_table_is_told_without_its_secrets(messages_of, url, words):
    (message,) = messages_of(None, url)
    assert words in message
    assert "SECRET" not in message


SETTINGS = """\
name: t
table: {file}
boulder: {{length: 1.65 m, width: 1.68 m, density: 2596 kg/m^3}}
site: {{embedment_ratio: 0.5}}
soil: {{density: 1859.9 kg/m^3, friction_angle: 43.2 deg, subgrade_reaction: 60 MN/m^3}}
vehicle: {{mass: 15000 lb, speed: 30 mph, spring: 3103.3 kN/m, damper: 138.91 kN*s/m}}
"""
HEIGHT = "boulder_height_m"


def parquet(**columns: object) -> bytes:
    sink = io.BytesIO()
    pq.write_table(pa.table(columns), sink, compression="zstd")
    return sink.getvalue()


def read(path: Path) -> None:
    """Read a table, or a measured curve if its name says so; all that may be raised is a list of mistakes."""
    try:
        if path.name.startswith("pulse"):
            read_history(path, PULSE_SIGNALS)
        else:
            assert load_text(SETTINGS.format(file=path.name), path.parent / "grid.yaml").n_designs > 0
    except SettingsError as refused:
        if not refused.problems or not all(map(str, refused.problems)):
            raise AssertionError("refused without a word") from refused


def spreadsheet(note: str = "a") -> bytes:
    book = Workbook()
    for row in ([HEIGHT, "note"], [2.5, note], [2.6, "b"], [3, "c"]):
        book.active.append(row)
    sink = io.BytesIO()
    book.save(sink)
    return sink.getvalue()


def test_a_spreadsheet_with_a_flipped_bit_is_refused_or_read_right(tmp_path):
    """Of a damaged file, zlib, the parser of XML and openpyxl raise almost anything."""
    chance, content, path = (
        random.Random(int(os.environ.get("TEST_SEED", "20263"))),
        spreadsheet(),
        tmp_path / "table.xlsx",
    )
    refusals = []
    for number in range(100):
        flipped = bytearray(content)
        flipped[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
        path.write_bytes(flipped)
        try:
            sweep = load_text(SETTINGS.format(file=path.name), tmp_path / "grid.yaml")
        except SettingsError as error:
            refusals.append(str(error))
        else:
            assert sweep.table.columns[HEIGHT].tolist() == [2.5, 2.6, 3.0], number
            assert list(sweep.table.labels) == ["note"], number
    assert len(refusals) > 50
    assert [text for text in refusals if "table.xlsx" not in text] == []


def test_a_cell_longer_than_a_spreadsheet_can_hold_is_refused_unread(tmp_path, monkeypatch):
    packed, path = io.BytesIO(), tmp_path / "table.xlsx"
    with (
        zipfile.ZipFile(io.BytesIO(spreadsheet("&LONG;"))) as old,
        zipfile.ZipFile(packed, "w", zipfile.ZIP_LZMA) as new,
    ):
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b"&amp;LONG;", b"x" * 1_000_000))
    path.write_bytes(packed.getvalue())
    monkeypatch.setattr("openpyxl.load_workbook", lambda *_, **__: pytest.fail("the cell was read"))
    with pytest.raises(SettingsError, match=r"table\.xlsx: has a cell of more than 32,767 characters"):
        load_text(SETTINGS.format(file=path.name), tmp_path / "grid.yaml")


def test_the_longest_cell_of_a_spreadsheet_is_read(tmp_path):
    (tmp_path / "table.xlsx").write_bytes(spreadsheet("\N{GRINNING FACE}" * 16_383))
    assert load_text(SETTINGS.format(file="table.xlsx"), tmp_path / "grid.yaml").n_designs == 3


def test_columns_of_every_type(tmp_path):
    columns = {
        "list": pa.array([[2.0], [3.0]]),
        "struct": pa.array([{"a": [1]}, {"a": None}]),
        "map": pa.array([[("k", 1)], []], type=pa.map_(pa.string(), pa.int64())),
        "bytes": pa.array([b"\xff\x1b", None]),
        "day": pa.array([1, 2], type=pa.date32()),
        "time": pa.array([1, None], type=pa.timestamp("ns")),
        "decimal": pa.array([1, 2], type=pa.decimal128(10, 2)),
        "truth": pa.array([True, None]),
        "nothing": pa.nulls(2),
        "half": pa.array(np.array([2.0, 2.5], dtype=np.float16)),
        "unsigned": pa.array([2, 2**64 - 1], type=pa.uint64()),
        "text": pa.array(["2.5", "=cmd()"]),
        "words": pa.array(["a", None]).dictionary_encode(),
    }
    for kind, values in columns.items():
        for name in (HEIGHT, f"{kind}_name"):
            path = tmp_path / "table.parquet"
            path.write_bytes(parquet(**{HEIGHT: pa.array([2.0, 2.5]), name: values}))
            read(path)


@pytest.mark.parametrize("name", ["table.csv", "table.parquet", "pulse.csv"])
def test_a_named_pipe_is_not_waited_for(tmp_path, name):
    """Whoever opens it for reading waits for one who opens it for writing, whom there is not."""
    os.mkfifo(tmp_path / name)
    writer = threading.Timer(HANG_GUARD_S, lambda: os.open(tmp_path / name, os.O_RDWR))  # hang guard
    writer.daemon = True
    writer.start()
    assert calls_of(lambda: read(tmp_path / name)) < 100_000
    assert writer.is_alive()
    writer.cancel()


@pytest.mark.parametrize("name", ["table.csv", "table.parquet", "pulse.csv"])
def test_more_columns_than_a_table_has(tmp_path, name):
    names = [f"c{position} [s]" for position in range(5000)]
    text = (",".join(names) + "\n" + ",".join("1" * len(names)) + "\n").encode()
    (tmp_path / name).write_bytes(parquet(**{name: [1.0] for name in names}) if name.endswith("parquet") else text * 2)
    assert calls_of(lambda: read(tmp_path / name)) < 100_000  # a few a column; there are 12 million pairs


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f'{HEIGHT},note\n2,"' + '\n","' * 300_000, "has a row of more than 1,000,000 characters; is a quotation mark"),
        (f"{HEIGHT},note\n2," + "x" * 1_000_001, "has a row of more than 1,000,000 characters"),
        (f"{HEIGHT},note\n2," + '"' + "x" * 200_000, "is a quotation mark not closed, or does text"),
        (f"{HEIGHT}\n" + "2\n" * 6, "has more than 6 lines"),
        (f"{HEIGHT}\n" + "\n#\n" * 3, "has more than 6 lines"),
        (f"{HEIGHT},a_id\n2,a\n2,b\n2,c\n", "column a_id has more than 2 different words"),
        (f"{HEIGHT},friction_angle_deg\n2,40\n2,40\n2,40\n", "has more than 40 bytes of numbers"),
        (f"{HEIGHT}\n" + "x\n" * 300, "is not read beyond this line: too many mistakes"),
    ],
)
def test_every_limit_of_a_text(tmp_path, monkeypatch, text, words):
    monkeypatch.setattr("boulder_sweep.settings.tables.MOST_ROWS", 6 if "lines" in words else 10**6)
    monkeypatch.setattr("boulder_sweep.settings.tables.MOST_WORDS", 2)
    monkeypatch.setattr("boulder_sweep.settings.tables._TOO_MANY_WORDS", "column {} has more than 2 different words")
    monkeypatch.setattr("boulder_sweep.settings.tables.MOST_BYTES", 40 if "bytes" in words else 10**6)
    monkeypatch.setattr("boulder_sweep.settings.tables.MOST_MISTAKES", 100)
    monkeypatch.setattr("boulder_sweep.settings.tables.CHUNK", 300)
    (tmp_path / "table.csv").write_text(text)
    with pytest.raises(SettingsError) as refused:
        load_text(SETTINGS.format(file="table.csv"), tmp_path / "grid.yaml")
    assert words in str(refused.value)
