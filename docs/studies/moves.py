"""What two laws that are switched off by default move: Broms' resistance of the soil, and a front that stiffens."""

from __future__ import annotations

from pathlib import Path

from boulder_sweep import load, need, uncertainty
from boulder_sweep.crash_tests.cases import NAMES
from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.impact.simulation import simulate

SITE = Path("configs/uncertain_site.yaml")
STIFFER = 3
"""Second spring over the first, an assumption: no value is published."""
BROMS = "model.resistance=broms"


def _spring(beyond: str) -> str:
    return f"vehicle.spring=[{{stiffness: 3103.3 kN/m}}, {{beyond: {beyond}, stiffness: {STIFFER * 3103.3:.1f} kN/m}}]"


CHOICES = {
    "as the files are": (),
    "3 K_p for K_p²": (BROMS,),
    f"spring {STIFFER} times as stiff from 1 m on": (_spring("1 m"),),
    f"spring {STIFFER} times as stiff from 0.5 m on": (_spring("0.5 m"),),
    f"3 K_p, and {STIFFER} times as stiff from 0.5 m on": (BROMS, _spring("0.5 m")),
}


def moves_table(root: Path) -> Table:
    """Return the rotation of both crash tests, and depth and probability of the uncertain site, by each choice."""
    titles = [f"{title}, max rotation [deg]" for title in NAMES.values()]
    table = Table(("choice", *titles, "site, P(pass)", "site, depth for 95 % [m]"))
    for name, overrides in CHOICES.items():
        shown = []
        for test in NAMES:
            found = simulate(load(root / "configs" / f"{test}.yaml", overrides)).summary()
            reached = found["time_to_limit_s"]
            shown.append(number(found["max_rotation_deg"], 2) if reached is None else f"over 20 after {reached:.4f} s")
        site = load(root / SITE, overrides)
        depth = need(site, probability=0.95).frame.passes_at[0]
        chance = uncertainty(site, half_width=0.01).frame.p_pass[0]
        table.add(name, *shown, number(chance, 2), number(depth, 2))
    return table
