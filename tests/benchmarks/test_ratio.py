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


class Answering:
    """A process with kernels, whose every third time is disturbed; the second one is that of kernels twice as fast."""

    started = 0

    def __init__(self, checkout: Path, cache: Path, designs: Path) -> None:
        self._us = 4.0 / 2.0**Answering.started
        Answering.started += 1
        self._asked = 0

    def cpu_s(self, designs: str, setting: ratio.Setting) -> float:
        self._asked += 1
        return 16e-6 * self._us * (1.0 if self._asked % 3 else 10.0)

    def end(self) -> None:
        """Nothing to end."""


def test_ratios_are_those_of_the_times_of_both_checkouts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ratio, "tables", lambda: {"random": sample(16)._asdict()})
    monkeypatch.setattr(ratio, "Kernels", Answering)
    monkeypatch.setattr(Answering, "started", 0)
    ratio.compare_kernels((tmp_path, tmp_path), (tmp_path, tmp_path), tmp_path, 9)
    found = re.findall(r"random +([\d.]+) +([\d.]+) +([\d.]+), ([\d.]+)$", capsys.readouterr().out, re.MULTILINE)
    assert found == [("4.000", "2.000", "2.000", "2.000")] * len(ratio.SETTINGS)


@pytest.mark.nightly
@pytest.mark.compiled
def test_a_process_with_the_kernels_of_a_checkout_answers_every_setting(tmp_path: Path) -> None:
    np.save(tmp_path / "random.npy", np.stack(list(sample(8))))
    kernels = ratio.Kernels(ratio.FOLDER, tmp_path / "cache", tmp_path)
    assert all(kernels.cpu_s("random", setting) >= 0.0 for setting in ratio.SETTINGS.values())
    kernels.end()
