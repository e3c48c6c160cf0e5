"""The kernel that is shipped: from these sources, and nothing but arithmetic."""

import subprocess
import sys

import pytest

from boulder_sweep.report.build import KERNEL, sources_hash, stamp_of


def test_the_kernel_is_that_of_these_sources():
    assert stamp_of(KERNEL.read_bytes()) == sources_hash(), "python -m boulder_sweep.report.build builds it anew"


def test_a_kernel_without_a_stamp_is_of_no_sources():
    assert stamp_of(b"\0asm\1\0\0\0") == ""


@pytest.mark.nightly
def test_built_anew_it_is_the_same_to_the_byte(tmp_path):
    again = tmp_path / "kernel.wasm"
    subprocess.run([sys.executable, "-m", "boulder_sweep.report.build", str(again)], check=True)
    assert again.read_bytes() == KERNEL.read_bytes()
