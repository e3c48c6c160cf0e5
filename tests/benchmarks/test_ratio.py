"""Times in proportion to another checkout: here the project itself, so that the ratios are near 1."""

import re
from pathlib import Path

import pytest

from benchmarks import ratio
from benchmarks.designs import sample


def test_the_settings_are_the_named_accuracies_and_the_printed_readings() -> None:
    found = ratio.settings()
    assert list(found) == ["fast", "balanced", "fine", "as_printed"]
    assert [setting.error_estimate for setting in found.values()] == [False, True, True, True]
    assert [setting.printed for setting in found.values()] == [False, False, False, True]


@pytest.mark.slow
def test_a_checkout_takes_as_long_as_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ratio, "tables", lambda: {"random": sample(1024)._asdict()})
    cache = tmp_path / "cache"
    ratio.compare_kernels((ratio.FOLDER, ratio.FOLDER), (cache, cache), tmp_path, 9)
    ratios = re.findall(r"([\d.]+), [\d.]+$", capsys.readouterr().out, re.MULTILINE)
    assert len(ratios) == len(ratio.settings())
    assert all(0.7 < float(found) < 1.4 for found in ratios)
