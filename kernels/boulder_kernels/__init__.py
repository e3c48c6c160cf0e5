"""Compiled kernels of boulder-sweep: the low-order model of a truck that hits an embedded boulder.

The model is from Brown et al., Low-order modeling of vehicle impacts upon boulders embedded in cohesionless soil;
equation numbers in this package are theirs. Everything here is plain numbers in SI units (angles in radians, the
subgrade reaction beta in MN/m^3 as in Eq 24), and nothing here knows of files, units or tables on disk.
"""

from ._jit import source_hash
from .control import Control
from .design import Constants, Design, DesignTable, Readings, as_printed, constants_of, corrected
from .impact import Problem
from .outcomes import SIMULATED, Maxima, Outcome, OutcomeTable, Record, Status, no_record
from .table import simulate, simulate_design, simulate_table

__all__ = [
    "SIMULATED",
    "Constants",
    "Control",
    "Design",
    "DesignTable",
    "Maxima",
    "Outcome",
    "OutcomeTable",
    "Problem",
    "Readings",
    "Record",
    "Status",
    "as_printed",
    "constants_of",
    "corrected",
    "no_record",
    "simulate",
    "simulate_design",
    "simulate_table",
    "source_hash",
]
