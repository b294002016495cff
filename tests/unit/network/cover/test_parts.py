"""Streets in parts, and loops that stay near their part."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import pytest
from click.testing import CliRunner

import loopgate.cli.cover_loops as command
from loopgate.cli.main import cli
from loopgate.network import RoadNetwork
from loopgate.network.cover import design
from loopgate.network.cover.design import CoverTask, make_design
from loopgate.network.cover.parts import parts
from loopgate.network.road import both_ways

GRID = str(Path(__file__).parents[4] / "networks" / "grid5-priority.net.xml")


@pytest.mark.parametrize("most", [10, 25, 50])
def test_each_street_is_in_one_part_with_its_other_direction(most: int) -> None:
    """No street is divided, and loops near a part cover all its streets, or they may drive anywhere."""
    network = RoadNetwork.open(GRID)
    found = parts(network, CoverTask(), 20, most=most)
    assert sorted(edge for part in found for edge in part.edges) == sorted(network.edges)
    assert len(found) >= 80 / most
    for part in found:
        assert len(part.edges) <= most
        assert all(len(street) == 2 for street in both_ways(network, part.edges))
        design = make_design(network, CoverTask(edges=part.edges, around=part.around))
        assert design.required == part.edges


def test_loops_stay_near_their_part_where_they_can() -> None:
    """Half of the grid closes by itself; of a corner only turning round leads back."""
    network = RoadNetwork.open(GRID)
    for part in parts(network, CoverTask(), 2, most=50):
        assert part.around is not None
        assert set(part.edges) < part.around < set(network.edges)
    assert None in {part.around for part in parts(network, CoverTask(), 20, most=10)}


def test_there_are_no_more_parts_than_loops() -> None:
    """One loop: one part. Two loops: two parts. A bound on their length: as many parts as it takes."""
    network = RoadNetwork.open(GRID)
    assert [part.around for part in parts(network, CoverTask(), 1, most=10)] == [None]
    assert len(parts(network, CoverTask(), 2, most=10)) == 2
    assert len(parts(network, CoverTask(longest=900.0), 1, most=10)) >= 8


def test_a_circulation_in_many_parts_is_joined_without_cuts(monkeypatch: pytest.MonkeyPatch) -> None:
    """The tour goes through all streets either way; cuts make it shorter, where they can be had."""
    network = RoadNetwork.open(GRID)
    monkeypatch.setattr(design, "_MOST_PARTS", 0)
    joined = make_design(network, CoverTask())
    assert sorted(joined.tour.tolist()) == list(range(len(joined.ways.nodes)))
    assert joined.ways.length(joined.tour.tolist()) < 1.1 * joined.circulation


@pytest.mark.usefixtures("hasty")
def test_the_command_covers_every_street_part_by_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each part has loops of its own, and all streets are covered."""
    monkeypatch.setattr(command, "parts", partial(parts, most=50))
    out = tmp_path / "loops.rou.xml"
    done = CliRunner().invoke(cli, ["loops", GRID, "--cover", "all", "--count", "8", "-o", str(out)])
    assert done.exit_code == 0, done.output
    assert "80 streets: covered in 2 parts, one after the other" in done.output
    assert 'id="part_1.0"' in out.read_text(encoding="utf-8")
    covered = re.findall(r"part \d: (\d+) of (\d+) streets covered", done.output)
    assert [sum(map(int, numbers)) for numbers in zip(*covered, strict=True)] == [80, 80]
