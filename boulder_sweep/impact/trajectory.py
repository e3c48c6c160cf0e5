"""One impact: its row of a table, its time history as arrays in SI units, their register, drawings and files."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boulder_kernels import Outcome, Readings
from boulder_sweep.columns import ColumnSpec
from boulder_sweep.drawing import draw
from boulder_sweep.errors import HistoryFileError
from boulder_sweep.impact.history import EnergyLedger, Motion, ledger_of
from boulder_sweep.judge.judged import Judged
from boulder_sweep.locations import replacing
from boulder_sweep.settings.model import ReadingChoice
from boulder_sweep.store.folder import check_target
from boulder_sweep.text import printable, why

if TYPE_CHECKING:
    import pyarrow as pa

_PEAK_TIMES = {
    "max_rotation_deg": ("time_of_max_rotation_s", "t_theta"),
    "max_displacement_m": ("time_of_max_displacement_s", "t_x_b"),
    "max_vehicle_displacement_m": ("time_of_max_vehicle_displacement_s", "t_x_v"),
    "peak_force_kN": ("time_of_peak_force_s", "t_F_v"),
}


HISTORY: tuple[ColumnSpec, ...] = (
    ColumnSpec("time_s", "s", "time since the first touch"),
    ColumnSpec(
        "boulder_displacement_m", "m", "displacement x_b of the common centre of mass of boulder and soil wedge"
    ),
    ColumnSpec(
        "boulder_centre_displacement_m",
        "m",
        "displacement of the boulder's own centre of mass, as a camera tracks it (Eqs 53 to 55, corrected)",
    ),
    ColumnSpec("boulder_velocity_m_s", "m/s", "velocity of the common centre of mass"),
    ColumnSpec("rotation_rad", "rad", "rotation theta_b of the boulder, positive with its top away from the vehicle"),
    ColumnSpec("angular_velocity_rad_s", "rad/s", "angular velocity of the boulder"),
    ColumnSpec("vehicle_displacement_m", "m", "displacement x_v of the vehicle"),
    ColumnSpec("vehicle_velocity_m_s", "m/s", "velocity of the vehicle"),
    ColumnSpec("vehicle_acceleration_m_s2", "m/s^2", "acceleration of the vehicle"),
    ColumnSpec("contact_force_N", "N", "force F_v of the vehicle on the boulder (Eq 47)"),
    ColumnSpec("contact_moment_N_m", "N*m", "its moment M_v about the common centre of mass (Eq 48)"),
    ColumnSpec("soil_force_N", "N", "sum of the soil's forces on the boulder (Eq 19)"),
    ColumnSpec("soil_moment_N_m", "N*m", "sum of the soil's moments about the common centre of mass (Eq 20)"),
    ColumnSpec("restoring_moment_N_m", "N*m", "restoring moment M_R of the boulder's weight (Eqs 37 to 39)"),
    ColumnSpec("rotation_mode", "", "seated, turning, held, limited or free", "dictionary"),
    ColumnSpec("in_contact", "", "touching or coasting", "dictionary"),
)

ENERGY: tuple[ColumnSpec, ...] = (
    ColumnSpec("energy_vehicle_kinetic_J", "J", "kinetic energy of the vehicle"),
    ColumnSpec("energy_crush_spring_J", "J", "stored in the spring of the vehicle's front"),
    ColumnSpec("energy_crush_damper_J", "J", "dissipated in the damper of the vehicle's front: permanent crush"),
    ColumnSpec("energy_boulder_linear_J", "J", "kinetic energy of boulder and soil wedge in translation"),
    ColumnSpec("energy_boulder_angular_J", "J", "kinetic energy of boulder and soil wedge in rotation"),
    ColumnSpec("energy_soil_elastic_J", "J", "stored in the springs of the soil"),
    ColumnSpec("energy_soil_drag_J", "J", "dissipated by the drag of the soil"),
    ColumnSpec(
        "energy_gravity_J",
        "J",
        "done against the boulder's weight: potential energy of the gravity couple; as printed the work of M_R",
    ),
    ColumnSpec(
        "energy_pull_J",
        "J",
        "printed separation only: work of the pull on the vehicle that nothing on the boulder answers, negative "
        "where energy appears from nowhere",
    ),
    ColumnSpec("energy_residual_J", "J", "sum of all parts minus the vehicle's energy at first touch"),
)

_BY_NAME: dict[str, ColumnSpec] = {spec.name: spec for spec in (*HISTORY, *ENERGY)}


@dataclass(frozen=True, eq=False)
class Trajectory:
    """One impact: its row of a table, and how it goes over time. Made by `boulder_sweep.simulate`.

    Arrays have the shape (n,), one value per sample, in SI units and radians; `HISTORY` says what each is. n is 0 where
    nothing moved because the truck passes over the boulder, or where the design could not be computed.

    Attributes
    ----------
    name, design_id
        Name of the sweep the design belongs to, and its number there.
    inputs : dict of str to float
        The design by the names and units of the table's input columns.
    settings : dict
        The resolved settings of the sweep.
    boulder_centre_displacement_m : ndarray
        Displacement of the boulder's own centre of mass, what a camera tracks:
        x_b + (L/2 - c_x)(cos theta - 1) + (H/2 - c_y) sin theta (Eqs 53 to 55, with bracket and sign of Eq 55
        corrected, and the value at rest subtracted).
    judged : Judged
        The outcome columns of its row of a table; `row` as plain data.
    decided : Outcome
        The impact up to where that row ends, at the limit or with a proof: when its maxima are reached.
    motion : Motion
        What the kernels were given and what they returned, for the whole time.
    """

    name: str
    design_id: int
    inputs: dict[str, float]
    settings: dict[str, Any]
    time_s: np.ndarray
    boulder_displacement_m: np.ndarray
    boulder_centre_displacement_m: np.ndarray
    boulder_velocity_m_s: np.ndarray
    rotation_rad: np.ndarray
    angular_velocity_rad_s: np.ndarray
    vehicle_displacement_m: np.ndarray
    vehicle_velocity_m_s: np.ndarray
    vehicle_acceleration_m_s2: np.ndarray
    contact_force_N: np.ndarray
    contact_moment_N_m: np.ndarray
    soil_force_N: np.ndarray
    soil_moment_N_m: np.ndarray
    restoring_moment_N_m: np.ndarray
    rotation_mode: np.ndarray
    in_contact: np.ndarray
    judged: Judged
    decided: Outcome
    motion: Motion

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.time_s)

    def __repr__(self) -> str:
        """Say what it is in a line."""
        words = " / ".join(word for word in (self.verdict, self.reason) if word)
        return f"<Trajectory {printable(self.name)} design {self.design_id}: {len(self)} samples, {words}>"

    @property
    def row(self) -> dict[str, Any]:
        """The outcome columns of its row of a table, as plain data; None for no value."""
        return self.judged.row(0)

    @property
    def verdict(self) -> str:
        """``pass``, ``fail``, ``undecided`` or ``error``."""
        return str(self.row["verdict"])

    @property
    def reason(self) -> str:
        """Why; empty for a pass."""
        return str(self.row["reason"])

    def energy(self) -> EnergyLedger:
        """Return where the vehicle's energy is at every sample."""
        return ledger_of(self.motion)

    def summary(self) -> dict[str, Any]:
        """Return the row of the table as plain data in its names and units, with the times of the maxima.

        ``energy_residual`` is what the energy ledger fails to account for, at most, as a share of the energy at first
        touch: a check of this very simulation. The readings and the representation of the soil close it.
        """
        result: dict[str, Any] = {"name": self.name, "design_id": self.design_id}
        for name, value in self.row.items():
            result[name] = value
            if name in _PEAK_TIMES:
                key, field = _PEAK_TIMES[name]
                result[key] = _plain(getattr(self.decided.maxima, field))
        model = self.settings["model"]
        result["energy_residual"] = _plain(self.energy().largest_residual)
        return result | {"preset": model["preset"], "readings": model["readings"], "soil": model["soil"]}

    def columns(self, *, energy: bool = False) -> dict[str, np.ndarray]:
        """Return the time history by the names of its columns, with the energy ledger where asked for."""
        columns = {spec.name: getattr(self, spec.name) for spec in HISTORY}
        if energy:
            ledger = self.energy()
            for spec in ENERGY:
                columns[spec.name] = getattr(ledger, spec.name.removeprefix("energy_"))
        return columns

    def to_arrow(self, *, energy: bool = False) -> pa.Table:
        """Return the time history as an Arrow table.

        Unit and meaning of every column stand in its field metadata; settings, versions and the call that repeats it in
        the metadata of the file, see `boulder_sweep.store.provenance.file_metadata`.
        """
        import pyarrow as pa  # heavy, and only files need it

        from boulder_sweep.store.provenance import file_metadata, identity

        types = {"float64": pa.float64(), "dictionary": pa.dictionary(pa.int32(), pa.string())}
        fields, arrays = [], []
        for name, values in self.columns(energy=energy).items():
            spec = _BY_NAME[name]
            array = pa.array(values)
            arrays.append(array.dictionary_encode() if spec.type == "dictionary" else array)
            fields.append(pa.field(name, types[spec.type], metadata={"unit": spec.unit, "meaning": spec.meaning}))
        readings = Readings(*ReadingChoice(**self.settings["model"]["readings"]).corrected)
        run_identity = identity(self.settings, readings._asdict(), self.motion.control._asdict())
        repeat = f"boulder_sweep.simulate({self.name!r}, {self.design_id})"
        return pa.Table.from_arrays(
            arrays, schema=pa.schema(fields, metadata=file_metadata(run_identity, repeat=repeat))
        )

    def to_parquet(self, path: str | Path, *, energy: bool = False) -> None:
        """Write the time history to a Parquet file, with the energy ledger where asked for.

        Raises
        ------
        HistoryFileError
            The name does not end in ``.parquet``, its folder does not exist, or it cannot be written.
        """
        import pyarrow.parquet as pq  # heavy, and only files need it

        table = self.to_arrow(energy=energy)
        target = checked_history(path)
        try:
            with replacing(target) as file:
                pq.write_table(table, file, compression="zstd", write_page_checksum=True)
        except OSError as problem:
            raise HistoryFileError(f"{path} cannot be written: {why(problem)}") from problem

    def plot(self, path: str | Path, *, units: str = "si") -> None:
        """Draw rotation, displacements and force over time, in ``si`` or ``us`` units (.png, .svg, .pdf).

        Raises
        ------
        PictureError
            There is nothing to draw, the kind is unknown, or matplotlib is not installed.
        """
        draw("time_curves", "draw_trajectory", self, path, units=units)

    def plot_energy(self, path: str | Path, *, units: str = "si") -> None:
        """Draw where the vehicle's energy goes, stacked over time; see `plot`."""
        draw("time_curves", "draw_energy", self, path, units=units)

    def plot_side_view(self, path: str | Path, *, time_s: float | None = None) -> None:
        """Draw the impact from the side at one instant, by default when the contact force peaks; see `plot`."""
        draw("side_view", "draw_still", self, path, time_s=time_s)

    def animate(self, path: str | Path, progress: Callable[[int, int], None] | None = None) -> None:
        """Draw a moving side view (.gif); `progress` is told how many frames of how many are drawn; see `plot`."""
        draw("side_view", "animate", self, path, progress)


def _plain(value: Any) -> float | None:
    """Number for JSON; None for NaN."""
    number = float(value)
    return number if math.isfinite(number) else None


def checked_history(path: str | Path) -> Path:
    """Return the path of a time history, or refuse one that cannot be written by a `HistoryFileError`.

    It has another ending, its folder does not exist or holds the result of a run, or it cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() != ".parquet":
        raise HistoryFileError(f"{path}: a time history is a Parquet file; its name must end in .parquet")
    check_target(target, HistoryFileError)
    return target
