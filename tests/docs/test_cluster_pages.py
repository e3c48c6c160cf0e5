"""The pages on SLURM and Kubernetes: their code runs as far as it goes without a cluster, and shows what they say."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def code(page: str, language: str) -> list[str]:
    """Return the blocks of a page in a language that are meant to be run here."""
    text = (DOCS / page).read_text(encoding="utf-8")
    text = re.sub(r"<!-- not run -->\n```.*?```", "", text, flags=re.DOTALL)
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def test_the_job_script_is_the_one_on_the_page(capsys):
    (source,), (shown,) = code("slurm.md", "python"), code("slurm.md", "bash")
    there: dict = {}
    exec(source, there)
    try:
        script = capsys.readouterr().out
        assert re.sub(r"tcp://[\d.]+:\d+", "tcp://ADDRESS", script).strip() == shown.strip()
        assert there["cluster"].scheduler_address.startswith("tcp://127.0.0.1:")
    finally:
        there["cluster"].close()


def test_the_manifest_has_what_the_page_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (source,) = code("kubernetes.md", "python")
    exec(source, {})
    spec = json.loads((tmp_path / "cluster.json").read_text())["spec"]
    assert spec["worker"]["replicas"] == 64
    assert spec["scheduler"]["service"]["ports"][0]["port"] == 8786
    for part in ("worker", "scheduler"):
        (container,) = spec[part]["spec"]["containers"]
        assert container["image"] == "registry.example.org/boulder-sweep:1"
        assert container["envFrom"] == [{"secretRef": {"name": "sweep-store"}}]
        assert container["resources"]["limits"]["cpu"] == "1"
        assert {"name": "AWS_ENDPOINT_URL", "value": "https://s3.example.org"} in container["env"]
    assert "SECRET" not in json.dumps(spec)


@pytest.mark.parametrize("page", ["slurm.md", "kubernetes.md"])
def test_commands_on_the_page_exist(page):
    """Options of ``sweep run`` that the pages use."""
    from boulder_sweep.cli.run import run

    known = {name for option in run.params for name in option.opts}
    text = (DOCS / page).read_text(encoding="utf-8")
    used = set(re.findall(r'(?<=[\s"`])--(?:backend|scheduler|resume|set|overwrite|jobs)\b', text))
    assert {"--backend", "--scheduler"} <= used <= known
