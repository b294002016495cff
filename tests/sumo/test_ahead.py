"""What a copy of the process sees does come, and it leaves no trace."""

from __future__ import annotations

from pathlib import Path

import libsumo
import pytest
from made_networks import netgenerate

from loopgate.simulation.fcd.film import FilmAhead
from loopgate.simulation.watching.ahead import SimulatedAhead
from loopgate.traffic import libsumo_backend
from loopgate.traffic.sumo import SumoTraffic

pytestmark = pytest.mark.sumo

LOOK_S, END_S = 60, 400
EVERY_S, MOVES_M = 5, 0.2


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Return options for a block of streets round which four flows lock up.

    Other vehicles depart later; SUMO reads them from the long file while it drives.
    """
    folder = tmp_path_factory.mktemp("block")
    options = "--grid --grid.number 2 --grid.length 80 --grid.attach-length 80"
    netgenerate(f"{options} --default-junction-type priority", folder / "n.net.xml")
    ways = (
        "bottom0A0 A0A1 A1B1 B1B0 B0right0",
        "left1A1 A1B1 B1B0 B0A0 A0left0",
        "top1B1 B1B0 B0A0 A0A1 A1top0",
        "right0B0 B0A0 A0A1 A1B1 B1right1",
    )
    flows = (
        f'<flow id="f{k}" begin="0" end="200" vehsPerHour="600" departSpeed="max">'
        f'<route edges="{way}"/></flow>'
        for k, way in enumerate(ways)
    )
    later = (
        f'<!--{" " * 300_000}--><vehicle id="l{at_s}" depart="{at_s}">'
        '<route edges="left0A0 A0bottom0"/></vehicle>'
        for at_s in (270, 300, 330, 360)
    )
    (folder / "d.rou.xml").write_text(f"<routes>{''.join((*flows, *later))}</routes>")
    return ["-n", str(folder / "n.net.xml"), "-r", str(folder / "d.rou.xml"), "--time-to-teleport", "-1"]


def driven(files: list[str], fcd: Path, *, look: bool) -> tuple[SimulatedAhead, dict[str, float], list[str]]:
    """Drive; return what is seen ahead, when each vehicle moved last from then on, and who is there then."""
    libsumo.start(["sumo", *files, "--no-step-log", "--fcd-output", str(fcd)])
    try:
        traffic = SumoTraffic(libsumo, libsumo_backend.ERROR, reads=libsumo_backend.READS)
        ahead = SimulatedAhead(traffic, traffic.step)
        assert SimulatedAhead.works(traffic)
        moved_s: dict[str, float] = {}
        before: dict[str, float] = {}
        for now in range(1, END_S + 1):
            traffic.step()
            if now == LOOK_S and look:
                ahead.look(ends=True)
            if now >= LOOK_S and now % EVERY_S == 0:
                at_m = dict(zip(traffic.vehicles(), traffic.odometers(traffic.vehicles()), strict=True))
                gone = before.keys() - at_m.keys()
                moved = [v for v in at_m if now > LOOK_S and at_m[v] - before.get(v, -1.0) > MOVES_M]
                moved_s |= dict.fromkeys((*moved, *gone), float(now))
                before = at_m
        return ahead, moved_s, sorted(before)
    finally:
        libsumo.close()


Looked = tuple[SimulatedAhead, dict[str, float], Path]


@pytest.fixture(scope="module")
def looked(files: list[str], tmp_path_factory: pytest.TempPathFactory) -> Looked:
    """Return what was seen ahead, when each vehicle moved last, and SUMO's positions."""
    fcd = tmp_path_factory.mktemp("fcd") / "looked.xml"
    ahead, moved_s, here = driven(files, fcd, look=True)
    assert len(here) > 20
    return ahead, moved_s, fcd


def test_what_a_copy_sees_comes(looked: Looked) -> None:
    """To the second, for each vehicle; a vehicle that it does not name as moving stands."""
    ahead, moved_s, _ = looked
    assert any(vehicle.startswith("l") for vehicle in moved_s)
    assert ahead.future.until_s >= END_S
    assert {v: at_s for v, at_s in ahead.future.moves_s.items() if LOOK_S < at_s <= END_S} == moved_s


def test_a_copy_leaves_no_trace(files: list[str], looked: Looked, tmp_path: Path) -> None:
    """SUMO's output is the same, byte for byte, but for the command in its head."""
    driven(files, tmp_path / "plain.xml", look=False)
    heads_end = "<fcd-export"
    assert (
        looked[2].read_text().partition(heads_end)[2]
        == (tmp_path / "plain.xml").read_text().partition(heads_end)[2]
    )


def test_left_alone_are_those_that_wait_for_each_other(files: list[str]) -> None:
    """All that stand in the block stand on without the others; a queue without its head drives on."""
    libsumo.start(["sumo", *files, "--no-step-log"])
    try:
        traffic = SumoTraffic(libsumo, libsumo_backend.ERROR, reads=libsumo_backend.READS)
        ahead = SimulatedAhead(traffic, traffic.step)
        for _ in range(END_S):
            traffic.step()
        block = {
            v for v in traffic.vehicles() if traffic.lane(v)[0] in {"A0A1_0", "A1B1_0", "B1B0_0", "B0A0_0"}
        }
        assert len(block) > 20
        alone = set(ahead.left_alone(traffic.vehicles(), block))
        assert alone >= block
        assert not ahead.left_alone({v for v in block if traffic.lane(v)[0] != "A0A1_0"}, block)
        assert traffic.now_s == END_S  # nothing happened here
        assert set(traffic.vehicles()) >= block
    finally:
        libsumo.close()


def test_a_film_knows_its_end(looked: Looked) -> None:
    _, moved_s, fcd = looked
    film = FilmAhead(fcd)
    film.look(ends=False)
    late = {v: at_s for v, at_s in moved_s.items() if at_s > LOOK_S + EVERY_S}
    assert film.future.until_s == END_S - 1.0
    assert all(abs(film.future.moves_s[v] - at_s) <= EVERY_S for v, at_s in late.items())


def test_a_copy_takes_nothing_from_files_that_are_gone(files: list[str], tmp_path: Path) -> None:
    """It cannot open such a file anew: it reads nothing, and the run reads on where it was."""
    gone = tmp_path / "gone.txt"
    gone.write_text("0123456789")
    libsumo.start(["sumo", *files, "--no-step-log"])
    try:
        traffic = SumoTraffic(libsumo, libsumo_backend.ERROR, reads=libsumo_backend.READS)
        with gone.open("rb", buffering=0) as text:

            def step() -> None:
                text.read(1)
                traffic.step()

            ahead = SimulatedAhead(traffic, step, end_s=1.0)
            gone.unlink()
            ahead.look(ends=True)
            assert ahead.future.until_s > 0.0
            assert text.read() == b"0123456789"
    finally:
        libsumo.close()
