"""The benchmark of answers runs, and finds no wrong bracket."""

from benchmarks.answers import measure


def test_small_measurement() -> None:
    table = measure(rows=400, verified=100, drawn=4096)
    assert len(table.rows) == 2
    assert any("100 random brackets" in note and note.endswith(" 0 wrong.") for note in table.notes)
