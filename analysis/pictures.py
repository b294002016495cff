"""The pictures of the concepts, as SVG: ``make pictures``. Laid out by hand; nothing is simulated."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import atan2, cos, degrees, hypot, sin
from pathlib import Path
from xml.sax.saxutils import escape

IMAGES = Path(__file__).resolve().parent.parent / "docs" / "images"

Point = tuple[float, float]

GROUND, ROAD, INK, SOFT = "#f1f2f0", "#ffffff", "#23292e", "#5b646c"
DRIVES, HELD, STUCK, WAY, FULL = "#1f6fb2", "#b35c00", "#b3261e", "#7a3fa0", "#2c7a4b"
LANE, CAR = 34.0, (38.0, 18.0)
SLOT = 50.0


@dataclass(slots=True)
class Sheet:
    """A picture under way: what was drawn later lies on top."""

    width: int
    height: int
    title: str
    parts: list[str] = field(default_factory=list)

    def add(self, tag: str, text: str = "", **how: object) -> None:
        """Add an element; underscores in names of attributes become hyphens."""
        words = " ".join(
            f'{name.rstrip("_").replace("_", "-")}="{_plain(value)}"' for name, value in how.items()
        )
        self.parts.append(f"<{tag} {words}>{escape(text)}</{tag}>" if text else f"<{tag} {words}/>")

    def road(self, *points: Point) -> None:
        """Draw a lane along its middle."""
        for colour, width in (("#c3c9ce", LANE + 3), (ROAD, LANE)):
            self.add("polyline", points=_line(points), fill="none", stroke=colour, stroke_width=width)

    def slots(self, front: Point, towards: float, count: int) -> None:
        """Draw the slots of a place from its stop line back; `towards` is the direction of travel [rad]."""
        for number in range(count):
            x, y = _ahead(front, towards, -SLOT * (number + 0.5))
            turn = f"rotate({_plain(degrees(towards))} {_plain(x)} {_plain(y)})"
            self.add(
                "rect", x=x - SLOT / 2 + 2, y=y - 14, width=SLOT - 4, height=28, rx=4, transform=turn,
                fill="none", stroke=FULL, stroke_width=1.6, stroke_dasharray="5 4",
            )  # fmt: skip
        (x, y), (u, v) = _ahead(front, towards, 2), (-sin(towards), cos(towards))
        self.add(
            "line", x1=x - 16 * u, y1=y - 16 * v, x2=x + 16 * u, y2=y + 16 * v, stroke=INK, stroke_width=3
        )

    def car(self, front: Point, towards: float, colour: str) -> None:
        """Draw a vehicle from its front back."""
        (x, y), (length, width) = front, CAR
        turn = f"translate({_plain(x)} {_plain(y)}) rotate({_plain(degrees(towards))})"
        half = width / 2
        shape = f"M0 {_plain(-half * 0.6)} L-7 {-half} H{-length} V{half} H-7 L0 {_plain(half * 0.6)} Z"
        self.add("path", d=shape, transform=turn, fill=colour)

    def queue(self, front: Point, towards: float, colours: str | list[str], count: int = 0) -> None:
        """Draw vehicles in the slots of a place, the head first."""
        for number, colour in enumerate([colours] * count if isinstance(colours, str) else colours):
            self.car(_ahead(front, towards, -SLOT * number - 6), towards, colour)

    def arrow(self, *points: Point, colour: str = INK, dashed: bool = False, width: float = 2.5) -> None:
        """Draw a line through these points with a head at its end; three are a curve."""
        (x, y), (u, v) = points[-2:]
        far = hypot(u - x, v - y)
        east, north = (u - x) / far, (v - y) / far
        end = (u - 9 * east, v - 9 * north)
        path = [points[0], *points[1:-1], end]
        kind = "Q" if len(path) == 3 else "L"  # noqa: PLR2004  a curve has one point beside its ends
        way = f"M{_line(path[:1])} {kind}{_line(path[1:])}"
        dash = {"stroke_dasharray": "6 4"} if dashed else {}
        self.add("path", d=way, fill="none", stroke=colour, stroke_width=width, **dash)
        head = [points[-1], (end[0] + 5 * north, end[1] - 5 * east), (end[0] - 5 * north, end[1] + 5 * east)]
        self.add("polygon", points=_line(head), fill=colour)

    def say(
        self, x: float, y: float, *lines: str, colour: str = INK, anchor: str = "start", bold: bool = False
    ) -> None:
        """Write lines of text, the first at this height."""
        weight = 600 if bold else 400
        for number, line in enumerate(lines):
            self.add(
                "text", line, x=x, y=y + 19 * number, fill=colour, text_anchor=anchor, font_weight=weight
            )

    def write(self, file: Path) -> None:
        """Write the picture."""
        frame = f'<rect width="{self.width}" height="{self.height}" fill="{GROUND}"/>'
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {self.height}" role="img" '
            f'font-family="system-ui, sans-serif" font-size="15"><title>{escape(self.title)}</title>'
        )
        file.write_text("\n".join((head, frame, *self.parts, "</svg>", "")), encoding="utf-8")


def _plain(value: object) -> str:
    return f"{value:.1f}".removesuffix(".0") if isinstance(value, float) else str(value)


def _line(points: list[Point] | tuple[Point, ...]) -> str:
    return " ".join(f"{_plain(float(x))},{_plain(float(y))}" for x, y in points)


def _ahead(point: Point, towards: float, far: float) -> Point:
    return point[0] + far * cos(towards), point[1] + far * sin(towards)


EAST, SOUTH, WEST, NORTH = 0.0, atan2(1, 0), atan2(0, -1), atan2(-1, 0)


def draw_place() -> Sheet:
    """Draw places, a crossing between them, and two movements that conflict."""
    sheet = Sheet(760, 300, "Two places, the crossing between them, and a movement that conflicts with it")
    sheet.road((0, 150), (760, 150))
    sheet.road((345, 0), (345, 300))
    sheet.add("rect", x=315, y=120, width=60, height=60, fill=ROAD)
    sheet.slots((285, 150), EAST, 4)
    sheet.slots((640, 150), EAST, 4)
    sheet.slots((345, 90), SOUTH, 1)
    sheet.queue((285, 150), EAST, [DRIVES, DRIVES])
    sheet.queue((640, 150), EAST, DRIVES, 3)
    sheet.car((345, 84), SOUTH, HELD)
    sheet.add("line", x1=327, y1=150, x2=363, y2=150, stroke="#e4c7f2", stroke_width=22)
    sheet.arrow((292, 150), (432, 150), colour=WAY)
    sheet.arrow((345, 98), (345, 215), colour=HELD, dashed=True)
    sheet.say(110, 205, "a place: 4 slots, 2 taken", anchor="middle", colour=FULL)
    sheet.say(540, 205, "the next place: one slot free", anchor="middle", colour=FULL)
    sheet.say(385, 100, "the crossing: granted together with that slot", colour=WAY)
    sheet.say(
        312, 40, "held at its stop line: the two", "movements share this stretch", colour=HELD, anchor="end"
    )
    sheet.arrow((290, 66), (330, 140), colour=SOFT, width=1.2)
    return sheet


def draw_gate() -> Sheet:
    """Draw when a vehicle asks, and what the gate looks at."""
    sheet = Sheet(760, 285, "A vehicle asks before it must brake; the gate looks at three things")
    sheet.road((0, 80), (760, 80))
    sheet.road((465, 0), (465, 160))
    sheet.add("rect", x=435, y=50, width=60, height=60, fill=ROAD)
    sheet.slots((405, 80), EAST, 7)
    sheet.slots((720, 80), EAST, 4)
    sheet.car((205, 80), EAST, DRIVES)
    sheet.queue((720, 80), EAST, DRIVES, 3)
    sheet.add("path", d="M210 80 H398", stroke=SOFT, stroke_width=1.2, stroke_dasharray="3 3", fill="none")
    sheet.add("line", x1=205, y1=55, x2=205, y2=105, stroke=SOFT, stroke_width=1.5)
    sheet.say(205, 40, "from here on it would have to brake: it asks", anchor="middle")
    sheet.say(302, 128, "its way to brake", colour=SOFT, anchor="middle")
    for number, (question, answer) in enumerate(
        (
            ("Is the way clear?", "Nobody is on a stretch that two movements share."),
            ("Is there a slot behind it?", "The next place has one that nobody else was granted."),
            ("Does no circle close?", "Follow the heads of full places: no walk comes back."),
        )
    ):
        y = 185 + 30 * number
        sheet.add("circle", cx=40, cy=y - 5, r=12, fill=WAY)
        sheet.say(40, y, str(number + 1), colour="#ffffff", anchor="middle", bold=True)
        sheet.say(62, y, question, bold=True)
        sheet.say(285, y, answer)
    return sheet


BLOCK = (
    ((395, 75), EAST, "A"),
    ((430, 270), SOUTH, "B"),
    ((235, 305), WEST, "C"),
    ((200, 110), NORTH, "D"),
)
"""Streets round a block, clockwise: where the head of each stands, its direction, its name."""


def _block(title: str) -> Sheet:
    sheet = Sheet(760, 380, title)
    for line in (
        ((0, 75), (640, 75)),
        ((430, 0), (430, 380)),
        ((640, 305), (0, 305)),
        ((200, 380), (200, 0)),
    ):
        sheet.road(*line)
    for x, y in ((430, 75), (430, 305), (200, 305), (200, 75)):
        sheet.add("rect", x=x - 19, y=y - 19, width=38, height=38, fill=ROAD)
    for front, towards, _ in BLOCK:
        sheet.slots(front, towards, 3)
    return sheet


def _corner(sheet: Sheet, number: int, colour: str, *, dashed: bool = False) -> None:
    """Draw where the head of a street wants to go: round the corner."""
    front, towards, _ = BLOCK[number]
    corner = _ahead(front, towards, 35)
    sheet.arrow(
        _ahead(front, towards, 4),
        corner,
        _ahead(corner, BLOCK[(number + 1) % 4][1], 40),
        colour=colour,
        dashed=dashed,
    )


def draw_lock_up() -> Sheet:
    """Draw why SUMO locks up: four full streets, each head wants the next."""
    sheet = _block(
        "Four full streets round a block: each first vehicle wants the next street, so nobody can ever move"
    )
    for number, (front, towards, _) in enumerate(BLOCK):
        sheet.queue(front, towards, STUCK, 3)
        _corner(sheet, number, STUCK)
    sheet.queue((165, 75), EAST, STUCK, 2)
    sheet.say(315, 165, "Every street is full.", anchor="middle", bold=True)
    sheet.say(
        315, 188, "Each first vehicle", "wants the next street", "and waits for a slot.", anchor="middle"
    )
    sheet.say(
        500,
        150,
        "Right of way cannot help:",
        "everybody keeps to it.",
        "The circle stays,",
        "and all behind it stand.",
    )
    return sheet


def draw_no_lock_up() -> Sheet:
    """Draw why this does not: the gate walks along the heads before it admits."""
    sheet = _block(
        "The move that would fill the last slot of the circle waits; the one that empties it goes first"
    )
    for number, (front, towards, _) in enumerate(BLOCK):
        sheet.queue(front, towards, DRIVES, 2 if number == 0 else 3)
        _corner(sheet, number, DRIVES)
    sheet.car((165, 75), EAST, HELD)
    sheet.arrow((170, 75), (235, 75), colour=HELD, dashed=True)
    for number, (name, x, y) in enumerate(
        (("A", 272, 48), ("B", 460, 195), ("C", 315, 342), ("D", 170, 195))
    ):
        sheet.say(x, y, name, anchor="middle", bold=True, colour=FULL if number else SOFT)
    sheet.say(20, 130, "wants the last", "slot of A: held", colour=HELD)
    sheet.say(315, 150, "With it A would be full.", anchor="middle", bold=True)
    walk = (
        "The head of A wants B,",
        "that of B wants C,",
        "that of C D, that of D A:",
        "the walk comes back.",
    )
    sheet.say(315, 173, *walk, anchor="middle")
    sheet.say(
        500,
        150,
        "So that slot is for the head",
        "of D. Then D has one for C,",
        "C for B, B for A:",
        "everybody goes on.",
    )
    return sheet


PICTURES = {
    "place.svg": draw_place,
    "gate.svg": draw_gate,
    "lock-up.svg": draw_lock_up,
    "no-lock-up.svg": draw_no_lock_up,
}


def main() -> None:
    """Draw all of them."""
    for name, draw in PICTURES.items():
        draw().write(IMAGES / name)
        print(IMAGES / name)


if __name__ == "__main__":
    main()
