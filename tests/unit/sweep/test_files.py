"""Files that travel with runs."""

from pathlib import Path

from loopgate.network.road import content_identity
from loopgate.sweep.files import pack, unpack

CONFIG = """<configuration><input>
<net-file value="../net/n.net.xml"/><route-files value="r.rou.xml"/>
</input></configuration>"""


def test_a_file_arrives_as_it_left(tmp_path: Path) -> None:
    """Name and content are the same; so is what identifies it."""
    file = tmp_path / "n.net.xml"
    file.write_text("<net/>" * 1000, encoding="utf-8")
    packed = pack(file)
    assert sum(len(content) for _, content in packed.members) < 200
    there = unpack(packed, tmp_path / "far")
    assert there.name == "n.net.xml"
    assert there.read_text(encoding="utf-8") == "<net/>" * 1000
    assert content_identity(there) == packed.identity


def test_a_configuration_travels_with_what_it_names(tmp_path: Path) -> None:
    """Relative paths hold at the other end; a change in the network is another identity."""
    for name, content in (
        ("cfg/a.sumocfg", CONFIG),
        ("net/n.net.xml", "<net/>"),
        ("cfg/r.rou.xml", "<routes/>"),
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(content, encoding="utf-8")
    packed = pack(tmp_path / "cfg" / "a.sumocfg")
    there = unpack(packed, tmp_path / "far")
    assert (there.parent / "../net/n.net.xml").read_text(encoding="utf-8") == "<net/>"
    assert content_identity(there) == packed.identity
    (tmp_path / "net" / "n.net.xml").write_text("<net></net>", encoding="utf-8")
    assert content_identity(tmp_path / "cfg" / "a.sumocfg") != packed.identity
