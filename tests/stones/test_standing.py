def test_what_counts_as_a_foot_is_what_a_settings_file_counts():
    from boulder_sweep.settings import shape
    from boulder_sweep.stones import standing

    assert standing.LEAST_FOOT == shape.LEAST_FOOT
