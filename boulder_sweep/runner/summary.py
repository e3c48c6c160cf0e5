"""What a run reports: progress on the way, a summary at the end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from boulder_sweep.errors import EXIT_DONE, EXIT_SOME_ROWS_FAILED
from boulder_sweep.locations import Location

if TYPE_CHECKING:
    from boulder_sweep.store.manifest import Manifest


@dataclass(frozen=True)
class Progress:
    """How far a run got; passed to the `progress` function of `run` up to ten times a second.

    Parameters
    ----------
    rows_done, rows
        Rows computed so far, including earlier runs; rows of the whole table.
    seconds
        Since the computing began.
    rows_per_second
        Computed by this run.
    seconds_left
        At that speed; None before there is one.
    notes
        What the user should know so far: damaged parts, lost workers.
    """

    rows_done: int
    rows: int
    seconds: float
    rows_per_second: float
    seconds_left: float | None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Summary:
    """What a finished run did.

    Parameters
    ----------
    out
        Folder of the table.
    rows
        Rows of the table.
    rows_computed
        Rows computed by this run; the others existed before.
    verdicts
        Rows of each verdict.
    reasons
        Rows of each verdict and reason, keyed ``verdict/reason``, or ``verdict`` where there is none.
    seconds
        From the call to the finished table.
    jobs, backend
        Workers.
    parts, bytes
        Files of the table and their size.
    accuracy
        The accuracy requested, the step chosen for it, and the error estimated by a pilot.
    firmness
        How many verdicts of a sample small changes of the inputs would change, see `boulder_sweep.judge.firmness`.
    notes
        What the user should know: damaged parts that were computed again, lost workers.
    boulder
        What is assumed of the boulders: their ``foot``, and whether the density of the rock is (``rock_assumed``).
    """

    out: Location
    rows: int
    rows_computed: int
    verdicts: dict[str, int]
    reasons: dict[str, int]
    seconds: float
    jobs: int
    backend: str
    parts: int
    bytes: int
    accuracy: dict[str, Any] = field(default_factory=dict)
    firmness: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    boulder: dict[str, Any] = field(default_factory=dict)

    @property
    def rows_per_second(self) -> float:
        """Rows computed by this run in a second, everything included."""
        return self.rows_computed / self.seconds if self.seconds > 0 else 0.0

    @property
    def errors(self) -> int:
        """Rows that could not be computed."""
        return self.verdicts.get("error", 0)

    @property
    def exit_code(self) -> int:
        """0, or 3 where some rows could not be computed."""
        return EXIT_SOME_ROWS_FAILED if self.errors else EXIT_DONE

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        return {
            **asdict(self),
            "out": str(self.out),
            "rows_per_second": self.rows_per_second,
            "errors": self.errors,
            "exit_code": self.exit_code,
        }


def progress_of(rows_before: int, rows_computed: int, rows: int, seconds: float, notes: Sequence[str] = ()) -> Progress:
    """Return the progress of a run.

    Parameters
    ----------
    rows_before
        Rows that existed when the run began.
    rows_computed
        Rows computed since.
    rows
        Rows of the whole table.
    seconds
        Since the computing began.
    notes
        What the user should know so far.
    """
    speed = rows_computed / seconds if seconds > 0 else 0.0
    done = rows_before + rows_computed
    return Progress(
        rows_done=done,
        rows=rows,
        seconds=seconds,
        rows_per_second=speed,
        seconds_left=(rows - done) / speed if speed > 0 else None,
        notes=tuple(notes),
    )


def summary_of(
    out: Location,
    manifest: Manifest,
    *,
    rows_computed: int,
    seconds: float,
    jobs: int,
    backend: str,
    firmness: dict[str, Any],
    notes: list[str],
) -> Summary:
    """Return the summary of a finished run from the manifest it left."""
    reasons = manifest.verdicts
    model = manifest.identity["settings"]["model"]
    verdicts: dict[str, int] = {}
    for key, count in reasons.items():
        verdict = key.partition("/")[0]
        verdicts[verdict] = verdicts.get(verdict, 0) + count
    return Summary(
        out=out,
        rows=manifest.rows,
        rows_computed=rows_computed,
        verdicts=verdicts,
        reasons=reasons,
        seconds=seconds,
        jobs=jobs,
        backend=backend,
        parts=len(manifest.parts),
        bytes=sum(part.bytes for part in manifest.parts.values()),
        accuracy=manifest.identity.get("accuracy", {}),
        firmness=firmness,
        notes=tuple(notes),
        boulder={name: model[name] for name in ("foot", "rock_assumed") if name in model},
    )
