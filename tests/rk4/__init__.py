"""A second opinion on whole impacts: the equations by the classical Runge-Kutta method, with no modes and no proofs.

Written from the paper. It shares no code with the kernels nor with `tests.oracle`, and differs from both in kind: fixed
short steps, every switch inside the right-hand side, the third-order Eq 45 of the truck as printed, the soil integrated
piece by piece with Gauss's rule. It is slow and plain, and serves to follow thousands of designs for ten seconds.
"""

from .integrator import Result, follow, follow_table

__all__ = ["Result", "follow", "follow_table"]
