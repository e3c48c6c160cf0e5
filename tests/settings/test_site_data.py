"""What a site gives stands for plain entries: the same designs, the same rows; files without it stay as they are."""

from __future__ import annotations

from pathlib import Path

from boulder_sweep import run
from boulder_sweep.settings import load
from boulder_sweep.store.reading import read_row

CONFIGS = Path(__file__).parents[2] / "configs"


def test_it_stands_for_plain_entries(tmp_path):
    """A file with readings and a street, and one with the constants that follow: equal settings and equal rows."""
    sweep = load(CONFIGS / "borehole.yaml")
    spread = {name: own.to_dict() for name, own in sweep.distributions.items()}
    angle, density, reaction = (
        spread[name] for name in ("friction_angle_deg", "soil_density_kg_m3", "subgrade_reaction_MN_m3")
    )
    text = (CONFIGS / "borehole.yaml").read_text()
    head, tail = text[: text.index("soil:")], text[text.index("vehicle:") :]
    soil = (
        "soil:\n"
        f"  friction_angle: {{mean: {sweep.constants['friction_angle_deg']!r} deg, sd: {angle['sd']} deg}}\n"
        f"  density: {{distribution: uniform, low: {density['low']!r}, high: {density['high']!r}}}\n"
        f"  subgrade_reaction: {{distribution: lognormal, mean: {sweep.constants['subgrade_reaction_MN_m3']!r}, "
        f"cov: {reaction['cov']!r}}}\n"
        "  correlation: 0.99\n\n"
    )
    way = tail.index("  approach:"), tail.index("\n", tail.index("  approach:"))
    tail = f"{tail[: way[0]]}  speed: {sweep.constants['impact_speed_m_s']!r} m/s{tail[way[1] :]}"
    (tmp_path / "plain.yaml").write_text(head + soil + tail)
    plain = load(tmp_path / "plain.yaml")
    resolved = sweep.resolved()
    derived = resolved.pop("derived")
    assert resolved == plain.resolved()
    assert set(derived) == {"soil", "approach"}
    rows = []
    for one, folder in ((sweep, "a"), (plain, "b")):
        run(one, tmp_path / folder)
        rows.append(read_row(tmp_path / folder, 0).to_pylist())
    assert rows[0] == rows[1]
