"""The report of a file of `sweep uncertainty`: its probabilities come first."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

import boulder_sweep
from boulder_sweep.errors import ReportError
from boulder_sweep.report import write_report
from boulder_sweep.report.answers import Quantity, answer_of
from boulder_sweep.report.rows import read_rows
from tests.answers.designs import site

UNCERTAIN = {"friction": "{mean: [36, 40] deg, cov: 5 %}", "height": "[3.0, 3.6] m", "site": "embedment_depth: 2.2 m"}


@pytest.fixture(scope="module")
def chances(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file of four designs, some of them safe."""
    file = tmp_path_factory.mktemp("chances") / "chances.parquet"
    boulder_sweep.uncertainty(site(**UNCERTAIN), half_width=0.1).write(file)
    return file


def test_the_probabilities_are_said_first(chances: Path) -> None:
    rows = read_rows(chances)
    frame = boulder_sweep.uncertainty(site(**UNCERTAIN), half_width=0.1).frame
    answer = answer_of(rows)
    safe = frame[frame.p_pass >= 0.95]
    assert 0 < len(safe) < 4
    assert str(answer.sentences[0][0]).startswith(f"{len(safe)} of 4 designs pass with a probability of 95% or more")
    mass = safe.eval("boulder_length_m * boulder_width_m * boulder_height_m * boulder_density_kg_m3").astype(float)
    lightest = int(mass.idxmin())
    assert [part.value for part in answer.sentences[0] if isinstance(part, Quantity)] == pytest.approx(
        [mass[lightest], 2.2]
    )
    assert f"P(pass) = {frame.p_pass[lightest]:.1%}" in str(answer.sentences[0][-1])
    assert answer.named[0].number == lightest
    assert "at the means of their uncertain inputs" in str(answer.sentences[1][0])


def test_the_page_has_them(chances: Path) -> None:
    page = write_report(chances, chances.with_suffix(".html")).read_text()
    assert "designs pass with a probability of 95% or more" in page
    assert "at the means of their uncertain inputs" in page


def test_one_design_has_its_interval_and_what_decides(tmp_path: Path) -> None:
    one = site(friction="{mean: 40 deg, cov: 5 %}", height="3.2 m")
    found = boulder_sweep.uncertainty(one, half_width=0.1)
    found.write(tmp_path / "one.parquet")
    row = found.frame.iloc[0]
    (first,) = answer_of(read_rows(tmp_path / "one.parquet")).sentences[0]
    assert first == (
        f"The probability of passing is {row.p_pass:.1%} ({row.p_pass_low:.1%} to {row.p_pass_high:.1%}), "
        "decided most by soil friction angle."
    )


def test_no_design_may_be_safe(tmp_path: Path) -> None:
    weak = site(friction="{mean: [30, 32] deg, cov: 5 %}", height="2.8 m")
    boulder_sweep.uncertainty(weak, half_width=0.1).write(tmp_path / "weak.parquet")
    first = str(answer_of(read_rows(tmp_path / "weak.parquet")).sentences[0][0])
    assert first.startswith("0 of 2 designs pass with a probability of 95% or more; the largest is ")


def test_other_files_are_refused(chances: Path, tmp_path: Path) -> None:
    boulder_sweep.need(site(height="3.4 m"), both_readings=False).write(tmp_path / "need.parquet")
    with pytest.raises(ReportError, match="nor a file that `sweep uncertainty` wrote"):
        write_report(tmp_path / "need.parquet", tmp_path / "page.html")
    (tmp_path / "text.parquet").write_text("text")
    with pytest.raises(ReportError, match="cannot be read as a Parquet file"):
        write_report(tmp_path / "text.parquet", tmp_path / "page.html")
    with pytest.raises(ReportError, match="there is no 9"):
        write_report(chances, tmp_path / "page.html", designs=[9])


def test_settings_of_another_version_are_said(chances: Path, tmp_path: Path) -> None:
    table = pq.read_table(chances)
    metadata = dict(table.schema.metadata)
    settings = json.loads(metadata[b"boulder_sweep.settings"])
    del settings["model"]["calibrated_crush_m"]
    metadata[b"boulder_sweep.settings"] = json.dumps(settings).encode()
    pq.write_table(table.replace_schema_metadata(metadata), tmp_path / "old.parquet")
    with pytest.raises(ReportError, match="another version, whose settings lack 'calibrated_crush_m'"):
        write_report(tmp_path / "old.parquet", tmp_path / "page.html")
