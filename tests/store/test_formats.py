"""Results of other versions are refused with the version that wrote them; other rules of this version are told."""

from __future__ import annotations

import warnings
from pathlib import Path

import pyarrow.parquet as pq
import pytest

import boulder_sweep
from boulder_sweep.answers.outputs import AnswerFile
from boulder_sweep.errors import OlderRulesWarning, ReportError
from boulder_sweep.store.failures import OtherVersionError
from boulder_sweep.store.files import MANIFEST_NAME
from boulder_sweep.store.provenance import file_metadata, identity_in, judged_by, versions
from boulder_sweep.store.reader import FinishedRows, read
from tests.answers.designs import site
from tests.store.folders import IDENTITY, OTHER_VERSIONS, ROWS, finished_folder, open_folder, rewrite_records


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a file of answers."""
    path = tmp_path_factory.mktemp("answers") / "need.parquet"
    boulder_sweep.need(site(), margin=0.1).write(path)
    return path


@pytest.mark.parametrize("version", OTHER_VERSIONS)
def test_a_table_of_another_version_is_refused_and_left_alone(tmp_path, version):
    change, words = OTHER_VERSIONS[version]
    out = finished_folder(tmp_path / "out")
    rewrite_records(out, lambda records: change(records["identity"]))
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    for act in (read, FinishedRows, open_folder, lambda folder: open_folder(folder, resume=True)):
        with pytest.raises(OtherVersionError) as refused:
            act(out)
        said = str(refused.value)
        assert said.startswith(f"{out} {words.format(versions()['boulder-sweep'])}")
        assert said.endswith(". Into the same folder, `sweep run` needs --overwrite")
        assert said.isprintable()
        assert len(said) < 500
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    open_folder(out, overwrite=True).close("stopped")
    assert [path.name for path in out.iterdir()] == [MANIFEST_NAME]


@pytest.mark.parametrize("version", OTHER_VERSIONS)
def test_a_file_of_answers_of_another_version_is_refused(answers, tmp_path, version):
    change, words = OTHER_VERSIONS[version]
    table = pq.read_table(answers)
    identity = identity_in(table.schema.metadata)
    change(identity)
    kept = {key: value for key, value in table.schema.metadata.items() if key != b"boulder_sweep.format"}
    other = tmp_path / "other.parquet"
    pq.write_table(table.replace_schema_metadata(kept | file_metadata(identity, identity["repeat"])), other)
    with pytest.raises(ReportError) as refused:
        AnswerFile(other, ReportError)
    assert str(refused.value).startswith(f"{other} {words.format(versions()['boulder-sweep'])}")


def test_a_manifest_without_an_identity_is_of_an_unknown_version(tmp_path):
    out = finished_folder(tmp_path / "out")
    rewrite_records(out, lambda records: records.pop("identity"))
    with pytest.raises(OtherVersionError, match="an unknown version"):
        read(out)


def test_nothing_is_said_of_a_table_of_this_version(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = read(finished_folder(tmp_path / "out"))
    assert (len(table), table.attrs["judged_by"]) == (ROWS, "")


@pytest.mark.parametrize("name", ["rules_sha256", "kernels_sha256"])
def test_other_rules_or_kernels_are_told(tmp_path, name):
    out = finished_folder(tmp_path / "out")
    rewrite_records(out, lambda records: records["identity"].update({name: "abcdef012345", "versions": {}}))
    words = rf"judged by the rules of version unknown \(.*{name[:-7]} abcdef01\W"
    with pytest.warns(OlderRulesWarning, match=words):
        read(out)


def test_who_wrote_no_hash_is_not_of_this_version():
    assert judged_by({}) == "judged by the rules of version unknown (rules unknown, kernels unknown)"
    assert judged_by(IDENTITY) == ""
    long = judged_by({"rules_sha256": "\x1b[2J" * 99, "versions": {"boulder-sweep": "9\n" * 10**6}})
    assert long.isprintable()
    assert len(long) < 200
