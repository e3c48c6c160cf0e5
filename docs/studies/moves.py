"""What a law that is switched off by default moves: Broms' resistance of the soil."""

from __future__ import annotations

from pathlib import Path

from boulder_sweep import load, need, uncertainty
from boulder_sweep.crash_tests.cases import NAMES
from boulder_sweep.crash_tests.tables import Table, number
from boulder_sweep.impact.simulation import simulate

SITE = Path("configs/uncertain_site.yaml")
CHOICES = {"as the files are": (), "3 K_p for K_p²": ("model.resistance=broms",)}


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
