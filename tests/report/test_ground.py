"""What the page says of soils as they lie."""

import pytest

import boulder_sweep
from boulder_sweep.errors import ReportError
from boulder_sweep.report import write_explorer
from tests.judge.test_ground import IN_FILE


def test_the_page_refuses_what_its_simulator_does_not_know(tmp_path) -> None:
    """Layers, cohesion, water below the soil line; a slope it knows."""
    for entry in IN_FILE[:3]:
        with pytest.raises(ReportError, match="neither layers, nor cohesion, nor a water table below the soil line"):
            write_explorer(boulder_sweep.load("configs/rwg.yaml", [entry]), 0, tmp_path / "page.html")
