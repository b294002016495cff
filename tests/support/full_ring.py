"""More loops than a block holds, and two trips that pass it when it is full."""

from pathlib import Path

from made_networks import netgenerate


def write_full_ring(folder: Path) -> dict[str, str]:
    """Write a small grid, and 24 loops round one of its blocks that depart before two trips."""
    network = netgenerate("--grid --grid.number=4 --grid.length=40", folder / "small.net.xml")
    ring = ["B1C1", "C1C2", "C2B2", "B2B1"]
    rows = [
        f'<vehicle id="l{k}" depart="{k}"><route edges="{edges}" repeat="9"/></vehicle>'
        for k in range(24)
        for edges in (" ".join(ring[k % 4 :] + ring[: k % 4]),)
    ]
    rows += [
        f'<vehicle id="t{k}" depart="90"><route edges="{way}"/></vehicle>'
        for k, way in enumerate(("A1B1 B1C1 C1D1", "D2C2 C2B2 B2A2"))
    ]
    routes = folder / "full.rou.xml"
    routes.write_text(f"<routes>{''.join(rows)}</routes>", encoding="utf-8")
    return {"network": str(network), "routes": str(routes)}
