"""Coefficients of the Dormand-Prince 5(4) pair, as data that check themselves.

Source: J. R. Dormand and P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6 (1980),
19-26, method RK5(4)7M; continuous extension of order four: L. F. Shampine, Some practical Runge-Kutta formulas,
Math. Comp. 46 (1986), 135-150.

Every motion here is of the form x' = v, v' = a(x, v). Stage displacements then need the stage accelerations only,

    v_i = v + h sum_j A_ij a_j
    x_i = x + h C_i v + h^2 sum_j AA_ij a_j      AA = A A

which is the same method on the same system with fewer numbers to keep.
"""

from __future__ import annotations

from fractions import Fraction as F

_A = (
    (),
    (F(1, 5),),
    (F(3, 40), F(9, 40)),
    (F(44, 45), F(-56, 15), F(32, 9)),
    (F(19372, 6561), F(-25360, 2187), F(64448, 6561), F(-212, 729)),
    (F(9017, 3168), F(-355, 33), F(46732, 5247), F(49, 176), F(-5103, 18656)),
    (F(35, 384), F(0), F(500, 1113), F(125, 192), F(-2187, 6784), F(11, 84)),
)
_C = (F(0), F(1, 5), F(3, 10), F(4, 5), F(8, 9), F(1), F(1))
_B_FOURTH = (
    F(5179, 57600),
    F(0),
    F(7571, 16695),
    F(393, 640),
    F(-92097, 339200),
    F(187, 2100),
    F(1, 40),
)
# Weight of stage i in the solution at the fraction tau of a step: sum over p = 1 ... 4 of _P[i][p - 1] tau^p.
_P = (
    (F(1), F(-8048581381, 2820520608), F(8663915743, 2820520608), F(-12715105075, 11282082432)),
    (F(0), F(0), F(0), F(0)),
    (F(0), F(131558114200, 32700410799), F(-68118460800, 10900136933), F(87487479700, 32700410799)),
    (F(0), F(-1754552775, 470086768), F(14199869525, 1410260304), F(-10690763975, 1880347072)),
    (
        F(0),
        F(127303824393, 49829197408),
        F(-318862633887, 49829197408),
        F(701980252875, 199316789632),
    ),
    (F(0), F(-282668133, 205662961), F(2019193451, 616988883), F(-1453857185, 822651844)),
    (F(0), F(40617522, 29380423), F(-110615467, 29380423), F(69997945, 29380423)),
)
STAGES = 7


def _entry(i: int, j: int) -> F:
    return _A[i][j] if j < len(_A[i]) else F(0)


def _check() -> None:
    """Refuse to import with a mistyped coefficient: row sums, order conditions of the weights, tau = 1."""
    for i in range(STAGES):
        assert sum(_A[i], F(0)) == _C[i], f"row {i} of the tableau does not sum to its node"
    for weights in ((*_A[6], F(0)), _B_FOURTH):
        for power in range(4):
            quadrature = sum(w * c**power for w, c in zip(weights, _C, strict=True))
            assert quadrature == F(1, power + 1), "the weights miss a quadrature condition"
    for i in range(STAGES):
        assert sum(_P[i]) == _entry(6, i), f"dense output of stage {i} does not end in the step"
        slope = sum(power * p for power, p in enumerate(_P[i], start=1))
        assert slope == (1 if i == STAGES - 1 else 0), f"dense output of stage {i} leaves the end with a kink"


_check()

C = tuple(float(c) for c in _C)
"""Nodes, shape (7,)."""
A = tuple(tuple(float(_entry(i, j)) for j in range(STAGES)) for i in range(STAGES))
"""Stage weights, shape (7, 7); the last row is the fifth-order solution."""
AA = tuple(
    tuple(float(sum((_entry(i, m) * _entry(m, j) for m in range(STAGES)), F(0))) for j in range(STAGES))
    for i in range(STAGES)
)
"""Weights of the accelerations in the stage displacements, A A, shape (7, 7)."""
E = tuple(float(_entry(6, i) - _B_FOURTH[i]) for i in range(STAGES))
"""Fifth- minus fourth-order weights, shape (7,)."""
P = tuple(tuple(float(p) for p in row) for row in _P)
"""Dense output of velocities, shape (7, 4): powers of tau from 1."""
PA = tuple(
    tuple(float(sum((_P[i][p] * _entry(i, j) for i in range(STAGES)), F(0))) for p in range(4))
    for j in range(STAGES)
)
"""Dense output of displacements, shape (7, 4): weights of the accelerations, times h^2."""
