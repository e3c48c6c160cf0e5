"""The report of a file of `sweep uncertainty`: its probabilities come first."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

import boulder_sweep
from boulder_sweep.answers.advice import advice
from boulder_sweep.answers.outputs import AnswerFile
from boulder_sweep.errors import ReportError
from boulder_sweep.report import write_report
from boulder_sweep.report.answers import Measure, answer_of, screens
from boulder_sweep.report.rows import read_rows
from boulder_sweep.report.sheet import sheet_of
from boulder_sweep.settings import load_text
from boulder_sweep.store.provenance import sha256_of
from tests.answers.designs import DEFAULTS, SITE, site
from tests.conftest import Command

UNCERTAIN = {"friction": "{mean: [36, 40] deg, cov: 5 %}", "height": "[3.0, 3.6] m", "site": "embedment_depth: 2.2 m"}


@pytest.fixture(scope="module")
def chances(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of four designs, some of them safe."""
    file = tmp_path_factory.mktemp("chances") / "chances.parquet"
    boulder_sweep.uncertainty(site(**UNCERTAIN), half_width=0.1).write(file)
    return file


@pytest.fixture(scope="module")
def of_a_list(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of a list of three designs."""
    folder = tmp_path_factory.mktemp("list")
    (folder / "designs.csv").write_text("boulder_height_m\n3.0\n3.2\n3.6\n")
    settings = SITE.format(**DEFAULTS | UNCERTAIN).replace("height: [3.0, 3.6] m, ", "").replace("[36, 40]", "40")
    found = boulder_sweep.uncertainty(
        load_text(f"table: designs.csv\n{settings}", folder / "list.yaml"), half_width=0.1
    )
    found.write(folder / "list.parquet")
    return folder / "list.parquet"


def test_the_probabilities_are_said_first(chances: Path) -> None:
    rows = read_rows(chances)
    frame = boulder_sweep.uncertainty(site(**UNCERTAIN), half_width=0.1).frame
    answer = answer_of(rows)
    safe = frame[frame.p_pass >= 0.95]
    assert 0 < len(safe) < 4
    assert str(answer.sentences[0][0]).startswith(f"{len(safe)} of 4 designs pass with a probability of 95% or more")
    assert "at the means of their uncertain inputs" in str(answer.sentences[1][0])
    own = safe.groupby("boulder_height_m").filter(lambda rows: len(rows) == 2)  # safe in both soils
    found = answer.need.recommendation
    assert (found.design is None) == own.empty
    assert advice(answer.need)[0] == (
        "No design of the run passes with a probability of 95\u00a0% in both soils."
        if own.empty
        else f"Bury the {own.boulder_height_m.min():g}\u00a0m boulder"
    )


def test_the_page_has_them(chances: Path) -> None:
    page = write_report(chances, chances.with_suffix(".html")).read_text()
    assert "designs pass with a probability of 95% or more" in page
    assert "at the means of their uncertain inputs" in page


def test_one_design_has_its_interval_and_what_decides(tmp_path: Path) -> None:
    one = site(
        friction="{distribution: uniform, low: 37 deg, high: 43 deg}",
        subgrade="{mean: 60 MN/m^3, sd: 2 MN/m^3}",
        height="3.2 m",
    )
    found = boulder_sweep.uncertainty(one, half_width=0.1)
    found.write(tmp_path / "one.parquet")
    row = found.frame.iloc[0]
    rows = read_rows(tmp_path / "one.parquet")
    screen = screens(rows, answer_of(rows))["si"]
    heads, shown = zip(*((head[0], cell(screen.rows[0])) for head, cell in screen.columns), strict=True)
    begin = heads.index("P(pass)")
    assert shown[begin : begin + 3] == tuple(f"{one:.4f}" for one in (row.p_pass, row.p_pass_low, row.p_pass_high))
    assert shown[heads.index("decided")] == "soil.friction_angle"
    sheet = sheet_of(rows, answer_of(rows), "si")
    words, low, high = sheet.words["us"], 100.0 * row.p_pass_low, 100.0 * row.p_pass_high
    assert words.question == "With what probability does the boulder stop a truck of 15,000\u00a0lb at 30\u00a0mph?"
    chance = f"{row.p_pass:.1%} ({low:.1f} to {high:.1f}%)"
    assert words.recommendation[0].startswith(f"The boulder passes with a probability of {chance}")
    assert words.untested.startswith("No crash test covers it: ")
    assert words.governs == "at the means of its uncertain inputs"
    assert sheet.checks[0] == ("probability of passing", f"{row.p_pass:.1%}", "–", "–")
    assert sheet.checks[1] == ("its interval", f"{low:.1f} to {high:.1f}%", "–", "–")
    assert sheet.soil[0] == (
        "friction angle φ′, mean",
        Measure(40.0, "deg"),
        dict.fromkeys(("si", "us"), "uniform, 37 to\u00a043°"),
    )
    assert sheet.soil[-1][2] == {"si": "normal, sd 2\u00a0MN/m³", "us": "normal, sd 7.368\u00a0pci"}
    assert dict(sheet.build)["excavation"].value > dict(sheet.build)["backfill"].value > 0.0


def test_no_design_may_be_safe(tmp_path: Path) -> None:
    weak = site(friction="{mean: [30, 32] deg, cov: 5 %}", height="2.8 m")
    boulder_sweep.uncertainty(weak, half_width=0.1).write(tmp_path / "weak.parquet")
    first = str(answer_of(read_rows(tmp_path / "weak.parquet")).sentences[0][0])
    assert first.startswith("0 of 2 designs pass with a probability of 95% or more; the largest is ")


def test_other_files_are_refused(chances: Path, tmp_path: Path) -> None:
    boulder_sweep.simulate(site(height="3.4 m", friction="40 deg")).to_parquet(tmp_path / "history.parquet")
    with pytest.raises(ReportError, match="is a time history; `sweep export` takes it"):
        write_report(tmp_path / "history.parquet", tmp_path / "page.html")
    (tmp_path / "text.parquet").write_text("text")
    with pytest.raises(ReportError, match="cannot be read as Parquet"):
        write_report(tmp_path / "text.parquet", tmp_path / "page.html")
    with pytest.raises(ReportError, match="there is no 9"):
        write_report(chances, tmp_path / "page.html", designs=[9])
    one = tmp_path / "one.parquet"
    pq.write_table(pq.read_table(chances).slice(0, 1), one)
    with pytest.raises(IndexError, match="the file has 1 design, numbered from 0; there is no 9"):
        AnswerFile(one, ReportError).row(9)


def said_of(file: Path) -> tuple[Any, ...]:
    """Return what the page says of a file first."""
    answer = answer_of(read_rows(file))
    return answer.sentences, answer.named, answer.row, *advice(answer.need)


def test_a_file_with_a_flipped_bit_is_refused_or_read_right(chances: Path, tmp_path: Path) -> None:
    """Values have checksums; settings, names and types of columns stand in the last part of the file."""
    content, file, chance = chances.read_bytes(), tmp_path / "chances.parquet", random.Random(22)
    whole, refused = said_of(chances), 0
    for _ in range(120):
        flipped = bytearray(content)
        flipped[-chance.randrange(1, 34_000)] ^= 1 << chance.randrange(8)
        file.write_bytes(flipped)
        try:
            assert said_of(file) == whole
        except ReportError:
            refused += 1
    assert refused > 40


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b'"name":"', b'"name":\xff'),
        (b"boulder_sweep.control", b"boulder_sweep.contrxl"),
        (b"boulder_sweep.settings", b"boulder_\xffsettings"),
        (b'"inputs"', b'"inpvts"'),
        (b"2.2", b"2.3"),
    ],
)
def test_settings_that_are_damaged_are_told(
    chances: Path, tmp_path: Path, sweep: Command, old: bytes, new: bytes
) -> None:
    table = pq.read_table(chances)
    damaged = {key.replace(old, new): value.replace(old, new) for key, value in table.schema.metadata.items()}
    assert damaged != table.schema.metadata
    pq.write_table(table.replace_schema_metadata(damaged), tmp_path / "chances.parquet")
    code, out, err = sweep("report", tmp_path / "chances.parquet")
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {tmp_path / 'chances.parquet'} ")


def test_a_column_name_that_is_no_text_is_told(chances: Path, tmp_path: Path, sweep: Command) -> None:
    content = chances.read_bytes().replace(b"boulder_height_m", b"boulder\xffheight_m")
    (tmp_path / "chances.parquet").write_bytes(content)
    code, out, err = sweep("report", tmp_path / "chances.parquet")
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {tmp_path / 'chances.parquet'}: cannot be read as Parquet: ")


@pytest.mark.parametrize(
    "kept", [lambda table: table.slice(1), lambda table: table.slice(0, len(table) - 1), lambda table: table[::-1]]
)
@pytest.mark.parametrize("kind", ["grid", "list"])
def test_a_file_with_rows_removed_or_moved_is_refused(
    kind: str, chances: Path, of_a_list: Path, tmp_path: Path, kept: Any, sweep: Command
) -> None:
    table = pq.read_table({"grid": chances, "list": of_a_list}[kind])
    assert len(table) > 1
    pq.write_table(kept(table), tmp_path / "other.parquet")
    with pytest.raises(ReportError, match=rf"does not hold the rows of its {len(table)} designs in"):
        write_report(tmp_path / "other.parquet", tmp_path / "page.html")
    code, out, err = sweep("report", tmp_path / "other.parquet")
    assert (code, out) == (2, "")
    assert err.startswith(f"error: {tmp_path / 'other.parquet'} does not hold the rows of its {len(table)} designs in")
    assert not list(tmp_path.glob("*.html"))


@pytest.mark.parametrize("entry", ["calibrated_crush_m", "preset"])
def test_settings_that_lack_an_entry_are_refused(chances: Path, tmp_path: Path, entry: str) -> None:
    table = pq.read_table(chances)
    metadata = dict(table.schema.metadata)
    settings = json.loads(metadata[b"boulder_sweep.settings"])
    del settings["model"][entry]
    metadata[b"boulder_sweep.settings"] = json.dumps(settings).encode()
    metadata[b"boulder_sweep.settings_sha256"] = sha256_of(settings).encode()
    pq.write_table(table.replace_schema_metadata(metadata), tmp_path / "other.parquet")
    with pytest.raises(ReportError, match=rf"is damaged \(settings.model.{entry} is missing\); write it again"):
        write_report(tmp_path / "other.parquet", tmp_path / "page.html")


def test_chances_by_other_rules_say_so(chances: Path, tmp_path: Path, sweep: Command) -> None:
    table = pq.read_table(chances)
    metadata = {**table.schema.metadata, b"boulder_sweep.rules_sha256": b"abcdef0123456789"}
    old = tmp_path / "old.parquet"
    pq.write_table(table.replace_schema_metadata(metadata), old)
    code, _, err = sweep("report", old, "-o", tmp_path / "page.html")
    assert code == 0
    judged = f"judged by the rules of version {boulder_sweep.__version__} (rules abcdef01, kernels "
    assert err.startswith(f"note: {old} was {judged}")
    assert f"The verdicts of the table were {judged}" in (tmp_path / "page.html").read_text()
    assert sweep("report", chances, "-o", tmp_path / "page.html")[2] == ""
    assert "The verdicts of the table were" not in (tmp_path / "page.html").read_text()
