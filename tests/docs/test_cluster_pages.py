"""The page on clusters: its code for SLURM and Kubernetes runs as far as it can without a cluster."""

from __future__ import annotations

import json
import re
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def section(title: str) -> str:
    """Return a section of the page."""
    return (DOCS / "clusters.md").read_text(encoding="utf-8").split(f"\n## {title}\n")[1].split("\n## ")[0]


def code(title: str, language: str) -> list[str]:
    """Return the blocks of a section in a language that are meant to be run here."""
    text = section(title)
    text = re.sub(r"<!-- not run -->\n```.*?```", "", text, flags=re.DOTALL)
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def test_the_job_script_is_the_one_on_the_page(capsys):
    (source,), (shown,) = code("SLURM", "python"), code("SLURM", "bash")
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
    (source,) = code("Kubernetes", "python")
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


def test_commands_on_the_page_exist():
    """Options of ``sweep run`` that the page uses."""
    from boulder_sweep.cli.run import run

    known = {name for option in run.params for name in option.opts}
    text = (DOCS / "clusters.md").read_text(encoding="utf-8")
    used = set(re.findall(r'(?<=[\s"`])--(?:backend|scheduler|resume|set|overwrite|jobs)\b', text))
    assert {"--backend", "--scheduler"} <= used <= known
