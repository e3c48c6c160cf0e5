"""Times in proportion to another checkout: here the project itself, so that the ratios are near 1."""

import io
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import boulder_kernels as bk
from benchmarks import ratio
from benchmarks.designs import sample
from boulder_sweep.judge.accuracy import STEPS, STEPS_PRINTED, Steps


def test_each_setting_is_simulated_by_the_steps_of_its_accuracy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    np.save(tmp_path / "random.npy", np.stack(list(sample(8))))
    asked = "".join(f"random {setting.accuracy} {setting.printed:d}\n" for setting in ratio.SETTINGS.values())
    seen: list[tuple[bk.Readings, bk.Control]] = []
    monkeypatch.setattr(sys, "stdin", io.StringIO(asked))
    monkeypatch.setattr(bk, "simulate_table", lambda _, readings, control: seen.append((readings, control)))
    ratio.answer_requests(tmp_path)
    steps = [*STEPS.values(), STEPS_PRINTED["balanced"]]
    assert [Steps(control.h, control.locate_yield) for _, control in seen] == steps
    assert [control.error_estimate for _, control in seen] == [False, True, True, True]
    assert [readings for readings, _ in seen] == [*[bk.corrected()] * 3, bk.as_printed()]


@pytest.mark.nightly
def test_a_checkout_takes_as_long_as_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ratio, "tables", lambda: {"random": sample(1024)._asdict()})
    cache = tmp_path / "cache"
    ratio.compare_kernels((ratio.FOLDER, ratio.FOLDER), (cache, cache), tmp_path, 9)
    ratios = re.findall(r"([\d.]+), [\d.]+$", capsys.readouterr().out, re.MULTILINE)
    assert len(ratios) == len(ratio.SETTINGS)
    assert all(0.7 < float(found) < 1.4 for found in ratios)
