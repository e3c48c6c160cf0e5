"""Names of soils and vehicles may be long: every one is read in full, and the maps keep their room."""

from __future__ import annotations

import itertools

import pandas as pd
import pytest

from boulder_sweep.views import pictures
from boulder_sweep.views.verdict_map import draw_verdict_map

LONG = ("compacted limestone gravel 2A modified", "砂礫 of the river", "W" * 80)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("soils", "title", "kind"),
    [
        (LONG, "gate", "svg"),
        (LONG, "gate", "pdf"),
        (LONG[:2], "gate", "png"),
        (LONG, "north gate of the depot, phase 2 revision C", "png"),
    ],
)
def test_long_names_leave_the_maps_their_room(table, tmp_path, monkeypatch, soils, title, kind):
    trucks = ("medium-duty truck 15000 lb at 30 mph", "car")
    rows = table.query("friction_angle_deg == 36 and subgrade_reaction_MN_m3 == 40 and boulder_width_m == 1.5")
    frames = [rows.assign(soil=soil, vehicle=truck) for soil in soils for truck in trucks]
    finished = []
    plain = pictures.save
    monkeypatch.setattr(pictures, "save", lambda fig, target: finished.append(fig) or plain(fig, target))
    words = {"title": title, "sets": {"soil": soils, "vehicle": trucks}, "columns": "soil", "rows": "vehicle"}
    draw_verdict_map(pd.concat(frames, ignore_index=True), tmp_path / f"map.{kind}", **words)
    (fig,) = finished
    if kind != "png":
        return
    names = {axes: axes._left_title for axes in fig.axes}
    legend, headline = fig.legends[0].get_window_extent(), fig._suptitle.get_window_extent()
    extents = [name.get_window_extent() for name in names.values()]
    for one, other in itertools.combinations([*extents, headline, legend], 2):
        assert not one.overlaps(other)
    for axes, name in names.items():
        assert axes.get_window_extent().width > 2.2 * fig.dpi
        assert name.get_window_extent().width <= axes.get_window_extent().width + 1.0
        assert not any(name.get_window_extent().overlaps(other.get_window_extent()) for other in fig.axes)
    together = "".join(name.get_text().replace("\n", "").replace(" ", "") for name in names.values())
    assert all(name.replace(" ", "") in together for name in (*soils, *trucks))
    assert headline.x1 <= fig.bbox.x1
