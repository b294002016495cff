"""Vehicles that stop on their way: nothing beyond is granted to them, and nobody counts on them."""

from shared_state import drive, world


def test_who_stops_before_its_line_is_granted_nothing_beyond() -> None:
    """It asks at its line, is refused for its stop, and goes on when that is over; that was no wait."""
    engine, traffic, notes = world(120.0)
    (driver,) = engine.drivers
    driver.row["stop_m"] = 198.0
    drive(engine, traffic, 60.0)
    assert [place for _, _, _, place in notes.of("grant")] == []
    keeper = engine._gatekeeper
    assert keeper is not None
    assert keeper.refusals == {"stop": 1}
    assert driver.stops_here
    assert driver.worst_wait_s(traffic.now_s) == 0.0
    driver.row["stop_m"] = 458.0
    engine.asks_anew(driver)
    for _ in range(5):
        engine.step()
    assert notes.of("grant")
    assert driver.worst_wait_s(traffic.now_s) < 5.0
