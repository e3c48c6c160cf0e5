"""What the README and the pages of the documentation print is what their commands print."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import boulder_sweep
from tests.docs.links import broken_links

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
ANSWERS, ACCURACY, CONFIDENCE, RUNNING, SETTINGS = (
    (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    for name in ("answers", "accuracy", "confidence", "running", "settings")
)


def marked(name: str, page: str = README) -> str:
    """Return the text between the markers of one block, without its fence."""
    found = re.search(rf"<!-- {name} -->\n(.*?)\n<!-- end -->", page, re.DOTALL)
    assert found, f"there is no block {name}"
    return re.sub(r"^```\w*\n|\n```$", "", found.group(1))


def sweep(*arguments: str, cwd: Path = ROOT) -> str:
    """Run the command line and return what it prints."""
    command = [sys.executable, "-m", "boulder_sweep", *arguments]
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def m30(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Run the README's main job: folder of the table, and what was printed."""
    out = tmp_path_factory.mktemp("readme") / "m30-sizing.sweep"
    return out, sweep("run", "configs/m30_sizing.yaml", "-o", str(out))


def test_the_main_job_counts_what_the_readme_shows(m30: tuple[Path, str]) -> None:
    shown = marked("m30-summary")
    assert shown in m30[1]


def test_the_first_answer() -> None:
    assert sweep("need", "configs/site.yaml").rstrip() == marked("need")


def test_what_robust_costs() -> None:
    command = ["need", "configs/site.yaml", "--margin", "0", "--any", "--table", "--set", "boulder.height=3.4 m"]
    assert sweep(*command).rstrip() == marked("need-least", ANSWERS)


def test_the_number_of_designs(m30: tuple[Path, str]) -> None:
    assert len(boulder_sweep.read(m30[0])) == 107_008
    assert "107 008 designs" in README


def test_the_python_example_prints_what_the_page_shows(m30: tuple[Path, str]) -> None:
    code = re.search(r"```python\n(import boulder_sweep.*?)```\n\n```text\n(.*?)```", RUNNING, re.DOTALL)
    assert code
    done = subprocess.run(
        [sys.executable, "-c", code.group(1)], cwd=m30[0].parent, capture_output=True, text=True, check=True
    )
    assert [line.rstrip() for line in done.stdout.splitlines()] == [
        line.rstrip() for line in code.group(2).splitlines()
    ]


def test_the_example_file_is_valid(tmp_path: Path) -> None:
    example = re.search(r"```yaml\n(.*?)```", README, re.DOTALL)
    assert example
    (tmp_path / "grid.yaml").write_text(example.group(1), encoding="utf-8")
    assert "valid" in sweep("check", "grid.yaml", cwd=tmp_path)
    shown = boulder_sweep.load(tmp_path / "grid.yaml")
    assert shown.notes == (), "what is shown as an example needs no remark"
    assert shown.name != "m30-sizing", "its run would find the folder of the first one"


def test_the_mistake_that_the_page_of_settings_shows(tmp_path: Path) -> None:
    mistaken = re.search(r"```text\n(grid\.yaml:.*?)\n```", SETTINGS, re.DOTALL)
    example = re.search(r"```yaml\n(.*?)```", README, re.DOTALL)
    assert mistaken
    assert example
    text = example.group(1).replace("friction_angle: [36, 40, 43.2] deg", "friction_angle: [36, 40, 432] deg")
    (tmp_path / "grid.yaml").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "boulder_sweep", "check", "grid.yaml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert mistaken.group(1) in done.stdout + done.stderr


def test_links_lead_somewhere() -> None:
    assert broken_links(ROOT / "README.md") == []


def test_the_named_accuracies_are_those_of_the_benchmark() -> None:
    """Same cells as the rows of the corrected readings in the table that the benchmark wrote."""
    benchmark = (ROOT / "benchmarks" / "README.md").read_text(encoding="utf-8")
    table = marked("named", benchmark)
    rows = [line.removeprefix("| corrected ") for line in table.splitlines() if line.startswith("| corrected ")]
    assert len(rows) == 3
    assert [line for line in ACCURACY.splitlines() if line.startswith(tuple(row[:8] for row in rows))] == rows


def test_the_errors_far_from_usual_designs_are_those_of_the_study() -> None:
    worst = marked("wild-families", ACCURACY).splitlines()[-1].split("|")
    shown = re.search(r"the largest errors are ([\d.]+)°, ([\d.]+)° and ([\d.]+)°", " ".join(ACCURACY.split()))
    assert shown
    assert list(shown.groups()) == [cell.strip() for cell in worst[3:6]]
    least = re.search(r"cover at least ([\d.]+) % of the true errors", " ".join(ACCURACY.split()))
    assert least
    assert min(float(share) for share in worst[6].split(",")) >= float(least[1])


def test_what_the_soil_on_the_approach_side_is_worth_is_that_of_the_study() -> None:
    assert "every passing M30 design overturns" in " ".join(README.split())
    passes, overturn = re.findall(r"Of (\d+) passes .*?, (\d+) overturn", marked("front-face", CONFIDENCE))[0]
    assert passes == overturn


def test_the_comparison_with_others_is_that_of_the_benchmark() -> None:
    """Milliseconds of the paper's way and the factors of both ways, in round numbers."""
    benchmark = (ROOT / "benchmarks" / "README.md").read_text(encoding="utf-8")
    costs = {}
    for line in marked("peers", benchmark).splitlines():
        cells = [cell.strip() for cell in line.split("|")[1:-1]]
        if len(cells) > 5 and cells[0] not in ("solver", "---"):
            costs[cells[0]] = (cells[-2], float(cells[-1].replace(",", "")))
    milliseconds, factor = costs.pop("the paper's way: SciPy RK45, NumPy sums, N = 5000")
    text = " ".join(ACCURACY.split())
    shown = re.search(r"takes some (\d+) ms of CPU time a design at 0\.01°, some (\d+) thousand times as much", text)
    assert shown
    assert float(milliseconds.removesuffix(" ms")) == pytest.approx(int(shown[1]), rel=0.1)
    assert factor == pytest.approx(1000 * int(shown[2]), rel=0.15)
    ours = costs.pop("boulder-sweep, lanes")[1]
    assert ours == 1.0
    for words, solver in (
        (r"plain C, vectorised by its compiler, (\d+) times", "plain C, RK4, 8 designs side by side, closed form"),
        (r"one design after another, (\d+) times", "boulder-sweep, single impact, events located"),
    ):
        found = re.search(words, text)
        assert found
        assert costs.pop(solver)[1] == pytest.approx(int(found[1]), rel=0.15)
    best = re.search(r"SciPy's LSODA over the compiled closed form, some (\d+) times", text)
    assert best
    solver = min(costs, key=lambda name: costs[name][1])
    assert solver == "SciPy LSODA, Numba closed form"
    assert costs[solver][1] == pytest.approx(int(best[1]), rel=0.15)
