"""What cannot work is refused before anything is compiled or computed."""

from __future__ import annotations

import pytest

from boulder_sweep.errors import BackendError
from boulder_sweep.runner import run as running
from boulder_sweep.runner.run import run
from boulder_sweep.store.failures import DoesNotFitError, StoreError
from tests.runner.grids import grid, grid_of

HUGE = {
    "width": "{from: 1 m, to: 2.5 m, count: 100000}",
    "height": "{from: 1.6 m, to: 3.4 m, count: 100000}",
    "subgrade": "{from: 20 MN/m^3, to: 100 MN/m^3, count: 100000}",
    "site": "embedment_ratio: 0.5",
    "friction": "40 deg",
}


@pytest.fixture(autouse=True)
def nothing_may_be_computed(monkeypatch):
    """It would compile the kernels first."""

    def never(*_):
        raise AssertionError("too late")

    monkeypatch.setattr(running, "accuracy_of", never)
    monkeypatch.setattr(running, "evaluation_of", never)


def test_a_grid_that_fits_on_no_disk(tmp_path):
    sweep = grid(**HUGE)
    assert sweep.n_designs == 10**15
    with pytest.raises(DoesNotFitError, match=r"1,000,000,000,000,000 rows needs at least 1 PB.*free.*another folder"):
        run(sweep, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["a file", "a file/out", "no such folder/out", "/sys/out", "/proc/out", "/dev/null"])
def test_an_output_that_cannot_be_written(tmp_path, name):
    (tmp_path / "a file").write_text("mine")
    with pytest.raises(StoreError):
        run(grid(), tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ["a file"]


@pytest.mark.parametrize(
    ("arguments", "problem", "words"),
    [
        ({"sweep": "grid.yaml"}, TypeError, "sweep must be what boulder_sweep.load returns, not str"),
        ({"sweep": None}, TypeError, "not NoneType"),
        ({"out": 5}, TypeError, "PathLike"),
        ({"jobs": 0}, ValueError, "jobs must be at least 1, not 0"),
        ({"jobs": -2}, ValueError, "jobs must be at least 1"),
        ({"jobs": 1_000_000}, ValueError, "jobs must be at most 4,096, not 1,000,000"),
        ({"jobs": "two"}, TypeError, "jobs must be a whole number, not str"),
        ({"jobs": 2.0}, TypeError, "jobs must be a whole number, not float"),
        ({"jobs": True}, TypeError, "jobs must be a whole number, not bool"),
        ({"progress": "bar"}, TypeError, "progress must be a function, not str"),
        ({"backend": "loky"}, BackendError, "unknown backend 'loky': choose one of threading, dask"),
        ({"backend": 3}, BackendError, "unknown backend 3"),
        ({"scheduler": "tcp://a:1"}, BackendError, "a scheduler address needs the backend dask, not threading"),
    ],
)
def test_wrong_arguments_are_named(tmp_path, arguments, problem, words):
    with pytest.raises(problem, match=words):
        run(**{"sweep": grid_of(10), "out": tmp_path / "out", **arguments})
    assert list(tmp_path.iterdir()) == []
