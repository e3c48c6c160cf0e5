"""The plan of very large tables: it counts as the runs do."""

from __future__ import annotations

import pytest
from distributed.scheduler import heartbeat_interval

from boulder_sweep.runner.workers import rows_per_task
from boulder_sweep.store.writer import ROWS_PER_PART
from docs.studies.scale import MOST_LOAD, VALUE, Plan, most_workers


@pytest.mark.parametrize("rows", [10**5, 10**7, 10**9, 10**12])
@pytest.mark.parametrize("workers", [1, 2, 64])
def test_tasks_are_those_of_a_run(rows, workers):
    expected = rows_per_task(VALUE["row_cpu_s"], rows, workers, ROWS_PER_PART)
    assert Plan(rows, workers).rows_per_task == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("workers", [1, 10, 11, 49, 50, 199, 200, 5000])
def test_heartbeats_come_as_often_as_dask_makes_them(workers):
    assert Plan(1e9, workers).beats_per_s == pytest.approx(workers / heartbeat_interval(workers))


def test_ten_million_designs_keep_to_a_tenth_of_a_byte_and_two_percent():
    plan = Plan(1e7, 2)
    assert plan.cluster_bytes / plan.rows < 0.1
    assert plan.load / 2 < 0.02


def test_manifests_are_written_as_often_as_they_may():
    assert Plan(1e7, 2).commits == pytest.approx(Plan(1e7, 2).parts)
    large = Plan(1e11, 256)
    assert large.commits < large.parts / 100


def test_the_most_workers_are_those_the_scheduler_can_serve():
    count = most_workers(2.0)
    assert Plan(1e12, count).load <= MOST_LOAD < Plan(1e12, count + 1).load
    assert Plan(1e12, 4096).seconds > Plan(1e12, 4096, 20.0).seconds
