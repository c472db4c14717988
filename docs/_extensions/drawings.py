"""The drawings of docs/pictures: `python docs/_extensions/drawings.py` draws them anew.

Positions of plates, names of balls, chains of axes and uncertainties are those that the program
computes. Drawings are dark on white, so that they can be read in light and dark pages and on paper,
and no meaning rests on colour alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

import ballplate
import numpy as np
from ballplate.extensions.drafting.machine_tables import arrangement_of, chain_words, table
from ballplate.extensions.drafting.shapes import VIEW, machine_shapes
from ballplate.simulator.geometry.artefacts import GridSettings
from ballplate.simulator.geometry.ball_layouts import BallLayout
from ballplate.simulator.geometry.poses import (
    IN_PLANE_AXES,
    PlanePlacement,
    Pose,
    ball_coordinates,
    nominal_pose,
)
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from numpy.typing import NDArray

PICTURES = Path(__file__).resolve().parents[1] / "pictures"
INK, NOTE, PALE = "#1c2330", "#4d5665", "#8a93a3"
PROBE, PLATE, WARM = "#0b5cad", "#0f7a52", "#b4430e"
FILLS = {PLATE: "#dff1e8", PROBE: "#dbe9f8", WARM: "#fbe6da", PALE: "#eef0f3"}

Point = Sequence[float] | NDArray[np.float64]


class Drawing:
    """Elements of an SVG file, from back to front; co-ordinates are in pixels, y downwards."""

    def __init__(self, width: int, height: int, title: str) -> None:
        self.width, self.height = width, height
        self.elements = [
            f"<title>{escape(title)}</title>",
            f'<rect width="{width}" height="{height}" fill="white"/>',
        ]

    def line(
        self, points: Sequence[Point], colour: str = INK, width: float = 1.2, dash: str = ""
    ) -> None:
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.elements.append(
            f'<polyline points="{_places(points)}" fill="none" stroke="{colour}"'
            f' stroke-width="{width}"{dashes}/>'
        )

    def area(self, points: Sequence[Point], colour: str = PLATE, opacity: float = 0.6) -> None:
        self.elements.append(
            f'<polygon points="{_places(points)}" fill="{FILLS[colour]}" '
            f'fill-opacity="{opacity}" stroke="{colour}" stroke-width="1.2"/>'
        )

    def circle(
        self, place: Point, radius: float, fill: str = INK, edge: str = "none", dash: str = ""
    ) -> None:
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        self.elements.append(
            f'<circle cx="{place[0]:.1f}" cy="{place[1]:.1f}" r="{radius:.1f}" fill="{fill}"'
            f' stroke="{edge}"{dashes}/>'
        )

    def text(
        self,
        place: Point,
        words: str,
        colour: str = INK,
        size: int = 13,
        anchor: str = "start",
        weight: str = "normal",
    ) -> None:
        self.elements.append(
            f'<text x="{place[0]:.1f}" y="{place[1]:.1f}" fill="{colour}" font-size="{size}" '
            f'text-anchor="{anchor}" font-weight="{weight}">{escape(words)}</text>'
        )

    def arrow(self, start: Point, end: Point, colour: str = INK, width: float = 1.6) -> None:
        start, end = np.asarray(start, float), np.asarray(end, float)
        along = (end - start) / np.linalg.norm(end - start)
        across = np.array([-along[1], along[0]])
        neck = end - 8 * along
        self.line([start, neck], colour, width)
        self.elements.append(
            f'<polygon points="{_places([end, neck + 4 * across, neck - 4 * across])}"'
            f' fill="{colour}"/>'
        )

    def dimension(self, start: Point, end: Point, colour: str = WARM) -> None:
        """A line with an arrow at both ends."""
        middle = (np.asarray(start, float) + np.asarray(end, float)) / 2
        self.arrow(middle, start, colour, 1.3)
        self.arrow(middle, end, colour, 1.3)

    def svg(self) -> str:
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width} {self.height}" '
            f'width="{self.width}" height="{self.height}" role="img" '
            'font-family="Helvetica, Arial, DejaVu Sans, sans-serif">'
        )
        return "\n".join([head, *self.elements, "</svg>"]) + "\n"


class Volume:
    """A machine's volume on paper: where a point (x, y, z) in metres is drawn."""

    def __init__(self, drawing: Drawing, origin: Point, scale: float) -> None:
        self.drawing, self.origin, self.scale = drawing, np.asarray(origin, float), scale

    def at(self, point: Point) -> NDArray[np.float64]:
        return self.origin + self.scale * (np.asarray(point, float) @ VIEW)

    def back(self) -> None:
        """Edges of a cubic metre, and the axes."""
        for corner in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1)):
            for axis in range(3):
                if corner[axis] == 0:
                    end = np.array(corner) + np.eye(3)[axis]
                    self.drawing.line([self.at(corner), self.at(end)], PALE, 0.8)
        for axis, name in enumerate("xyz"):
            tip = self.at(1.16 * np.eye(3)[axis])
            self.drawing.arrow(self.at((0, 0, 0)), tip, INK, 1.3)
            self.drawing.text(tip + np.array([5.0, 2.0]), name, size=14, weight="bold")

    def front(self) -> None:
        """The y axis once more, dashed, where plates stand before it."""
        tip = self.at((0, 1.16, 0))
        self.drawing.line([self.at((0, 0, 0)), tip], INK, 0.8, "3 3")
        self.drawing.text(tip + np.array([5.0, 2.0]), "y", size=14, weight="bold")

    def plate(self, pose: Pose, layout: BallLayout, radius: float = 2.6) -> None:
        balls = ball_coordinates(pose, layout)
        self.drawing.area([self.at(balls[i]) for i in _outline(layout)])
        for ball in balls:
            self.drawing.circle(self.at(ball), radius, PLATE)


def _places(points: Sequence[Point]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _outline(layout: BallLayout) -> list[int]:
    """The corner balls of a grid, one after the other round it."""
    places = layout.coordinates[list(layout.corner_set), :2]
    angles = np.arctan2(*(places - places.mean(axis=0)).T[::-1])
    return [layout.corner_set[i] for i in np.argsort(angles)]


def _grid(columns: int, rows: int, width: str, height: str) -> BallLayout:
    settings = {"kind": "grid", "balls": (columns, rows), "size": (width, height)}
    return GridSettings.model_validate(settings).layout()


def placement() -> Drawing:
    """Plane, level and corner in the volume; corner, centre and quarter turns seen along the
    normal.
    """
    drawing = Drawing(860, 600, "Plane, level, corner, centre, quarter turns and names of balls")
    layout = _grid(4, 3, "600 mm", "400 mm")
    examples = (("z", 0.5, (0.25, 0.3)), ("x", 0.5, (0.3, 0.25)), ("y", 0.5, (0.25, 0.3)))
    for number, (plane, level, corner) in enumerate(examples):
        _plane_panel(drawing, 285 * number, layout, plane, level, corner)
    drawing.line([(20, 325), (840, 325)], PALE, 0.8)
    for turns in range(4):
        _turn_panel(drawing, 30 + 210 * turns, layout, turns)
    note = (
        "Seen against the plane's normal. The corner is where the turned plate has its smallest"
        " co-ordinates."
    )
    drawing.text((20, 588), note, NOTE, 11)
    return drawing


def _plane_panel(
    drawing: Drawing,
    left: float,
    layout: BallLayout,
    plane: str,
    level: float,
    corner: tuple[float, float],
) -> None:
    first, second = IN_PLANE_AXES[plane]
    normal, one, other = ("xyz".index(axis) for axis in (plane, first, second))
    pose = nominal_pose(PlanePlacement(plane, level, "corner", corner), layout, 3)
    volume = Volume(drawing, (left + 50, 250), 160)
    drawing.text((left + 20, 26), f"plane: {plane}", size=15, weight="bold")
    drawing.text((left + 100, 26), f"rows along {first}, columns along {second}", NOTE, 11)
    volume.back()
    # The part of the volume's section at this level that shows where the corner is.
    section = np.zeros((4, 3))
    section[:, normal] = level
    section[[1, 2], one] = 1
    section[[2, 3], other] = 1
    drawing.line([volume.at(place) for place in (*section, section[0])], PALE, 0.8, "4 3")
    volume.plate(pose, layout)
    volume.front()
    balls = ball_coordinates(pose, layout)
    foot = np.zeros(3)
    foot[normal] = level
    drawing.dimension(volume.at((0, 0, 0)), volume.at(foot))
    beside = {"x": (-4.0, 22.0), "y": (14.0, 14.0), "z": (-34.0, 4.0)}[plane]
    drawing.text(volume.at(foot / 2) + np.array(beside), "level", WARM, 12)
    start = balls[layout.names.index("r1c1")]
    legs = [foot, foot.copy(), start]
    legs[1][one] = start[one]
    drawing.line([volume.at(leg) for leg in legs], WARM, 1.3, "2 2")
    drawing.circle(volume.at(start), 4.5, WARM, INK)
    drawing.text(volume.at(start) + np.array([8.0, 18.0]), "corner", WARM, 12)


def _turn_panel(drawing: Drawing, left: float, layout: BallLayout, turns: int) -> None:
    scale, bottom = 195.0, 548.0
    pose = nominal_pose(PlanePlacement("z", 0, "corner", (0.2, 0.15), turns), layout, 3)
    flat = ball_coordinates(pose, layout)[:, :2]

    def at(point: Point) -> tuple[float, float]:
        return left + scale * point[0], bottom - scale * point[1]

    drawing.text((left - 10, 352), f"quarter_turns: {turns}", size=14, weight="bold")
    drawing.arrow(at((0, 0)), at((0.92, 0)), INK, 1.2)
    drawing.arrow(at((0, 0)), at((0, 0.88)), INK, 1.2)
    drawing.text(at((0.88, -0.09)), "x")
    drawing.text(at((-0.07, 0.85)), "y", anchor="middle")
    drawing.area([at(flat[i]) for i in _outline(layout)])
    names = layout.names
    for first, second in (("r1c1", "r1c4"), ("r2c1", "r2c4"), ("r3c1", "r3c4")):
        drawing.line([at(flat[names.index(first)]), at(flat[names.index(second)])], PLATE, 0.6)
    for place in flat:
        drawing.circle(at(place), 3, PLATE)
    lower, middle = flat.min(axis=0), (flat.min(axis=0) + flat.max(axis=0)) / 2
    drawing.circle(at(lower), 8, "none", WARM)
    drawing.text(at(lower - np.array([0.0, 0.11])), "corner", WARM, 12, "middle")
    for across in (np.array([0.025, 0.025]), np.array([0.025, -0.025])):
        drawing.line([at(middle - across), at(middle + across)], WARM, 1.8)
    drawing.text(at(middle + np.array([0.03, 0.02])), "centre", WARM, 11)
    centre = flat.mean(axis=0)
    for name in ("r1c1", "r1c4", "r3c1"):
        place = flat[names.index(name)]
        outwards = np.sign(place - centre) * np.array([0.075, 0.075])
        if name == "r1c1":
            drawing.circle(at(place), 4.5, INK)
        if np.allclose(place, lower):
            outwards = np.array([-0.105, 0.05])
        x, y = at(place + outwards)
        drawing.text((x, y + 4), name, size=12, anchor="middle")


FAMILIES = {
    "MB": "moving bridge",
    "FB": "fixed bridge",
    "MH": "moving horizontal arm",
    "FH": "fixed horizontal arm",
    "CX": "column, x below y",
    "CY": "column, y below x",
}


def arrangements() -> Drawing:
    """The ten arrangements as chains of axes from the ground to the probe and to the workpiece."""
    drawing = Drawing(860, 540, "The ten arrangements and what carries what")
    order = ("MB1", "FB1", "MH1", "FH1", "CX1", "MB2", "FB2", "MH2", "FH2", "CY1")
    for number, name in enumerate(order):
        row, column = divmod(number, 5)
        _chain_panel(drawing, 10 + 170 * column, 10 + 252 * row, name)
    drawing.text(
        (20, 522),
        "Each block stands on what carries it and moves everything above it. Arrows show how it"
        " moves: x to the right, y away from you, z up.",
        NOTE,
        12,
    )
    return drawing


def _chain_panel(drawing: Drawing, left: float, top: float, name: str) -> None:
    arrangement = ARRANGEMENTS[name]
    ground, height = top + 222, 38
    drawing.text((left + 10, top + 20), name, size=16, weight="bold")
    drawing.text((left + 10, top + 37), FAMILIES[name[:2]], NOTE, 12)
    sides = (
        (left + 42, arrangement.probe_side, "probe", PROBE),
        (left + 118, arrangement.workpiece_side, "workpiece", PLATE),
    )
    for middle, axes, end, colour in sides:
        for number, axis in enumerate(axes):
            _axis_block(drawing, middle, ground - height * (number + 1), height, axis, colour)
        level = ground - height * len(axes)
        if end == "probe":
            drawing.line([(middle, level), (middle, level - 18)], colour, 2)
            drawing.circle((middle, level - 22), 5, WARM, INK)
        else:
            block = ((-22, 0), (22, 0), (22, -14), (-22, -14))
            drawing.area([(middle + x, level + y) for x, y in block], PALE, 1)
        label = level - (32 if end == "probe" else 20)
        drawing.text((middle, label), end, colour, 12, "middle")
    drawing.line([(left + 4, ground), (left + 158, ground)], INK, 2.5)
    for x in range(8, 156, 12):
        drawing.line([(left + x + 6, ground), (left + x, ground + 7)], PALE, 0.8)


def _axis_block(
    drawing: Drawing, middle: float, top: float, height: float, axis: str, colour: str
) -> None:
    corners = ((-34, 0), (34, 0), (34, height), (-34, height))
    drawing.area([(middle + x, top + y) for x, y in corners], colour, 1)
    drawing.text((middle - 24, top + height / 2 + 6), axis, size=16, weight="bold")
    direction = 15 * VIEW["xyz".index(axis)] / np.linalg.norm(VIEW["xyz".index(axis)])
    if axis == "x":
        direction = np.array([17.0, 0.0])
    place = np.array([middle + 12, top + height / 2])
    drawing.dimension(place - direction, place + direction, INK)


COLOURS = {"probe": PROBE, "workpiece": PLATE, "still": PALE}


def machines() -> Drawing:
    """Kinds of machines with the axis that moves each part, and which axis carries which."""
    drawing = Drawing(860, 600, "Kinds of machines and which axis carries which")
    for number, kind in enumerate(table("kinds")):
        row, column = divmod(number, 3)
        left, top = 15 + 285 * column, 10 + 285 * row
        arrangement = arrangement_of(kind, (1.0, 1.0, 1.0))
        drawing.text((left, top + 20), kind, size=15, weight="bold")
        drawing.text((left, top + 38), f"{arrangement}: {chain_words(arrangement)}", NOTE, 12)
        volume = Volume(drawing, (left + 20, top + 225), 130)
        for shape in machine_shapes(kind):
            points = [volume.at(point) for point in shape.points]
            if shape.role == "stylus":
                drawing.line(points, WARM, 2)
                drawing.circle(points[1], 4, WARM, INK)
            elif shape.role == "letter":
                drawing.text(
                    points[0] + np.array([0.0, 5.0]), shape.text, INK, 14, "middle", "bold"
                )
            else:
                drawing.area(points, COLOURS[shape.role], 1)
    drawing.text(
        (20, 588),
        "A letter is the axis that moves the part: blue parts carry the probe, green ones the"
        " workpiece. x points right, y away from you, z up.",
        NOTE,
        12,
    )
    return drawing


def uncertainties() -> Drawing:
    """What U4, U5 and U6 are the standard uncertainties of."""
    drawing = Drawing(860, 330, "What U4, U5 and U6 are uncertainties of")
    titles = (
        ("U4", "error function at a point"),
        ("U5", "distance between two balls"),
        ("U6", "distance between corrected points"),
    )
    for number, (symbol, words) in enumerate(titles):
        drawing.text((20 + 285 * number, 26), symbol, size=17, weight="bold")
        drawing.text((52 + 285 * number, 26), words, size=13)
    _error_panel(drawing, 30, corrected=False)
    _ball_panel(drawing, 315)
    _error_panel(drawing, 600, corrected=True)
    return drawing


def _bent(point: Point) -> NDArray[np.float64]:
    """A point of the unit square, displaced as by a machine's errors, much magnified."""
    x, y = point
    return np.array([x + 0.10 * y * y + 0.02 * np.sin(3 * x), y + 0.09 * x * x - 0.03 * x])


def _error_panel(drawing: Drawing, left: float, corrected: bool) -> None:
    def at(point: Point) -> NDArray[np.float64]:
        return np.array([left + 190 * point[0], 255 - 190 * point[1]])

    grid = np.linspace(0, 1, 5)
    for value in grid:
        for straight in ([(t, value) for t in grid], [(value, t) for t in grid]):
            drawing.line([at(point) for point in straight], PALE, 0.6, "2 3")
        fine = np.linspace(0, 1, 25)
        for bent in ([_bent((t, value)) for t in fine], [_bent((value, t)) for t in fine]):
            drawing.line([at(point) for point in bent], PROBE, 0.9)
    if not corrected:
        scale, true = at((0.75, 0.75)), at(_bent((0.75, 0.75)))
        drawing.circle(true, 13, FILLS[WARM], WARM, "3 2")
        drawing.arrow(scale, true, WARM, 2.2)
        drawing.circle(scale, 3.5, INK)
        drawing.text(true + np.array([16.0, -6.0]), "e(x)", WARM, 14)
        drawing.text(scale + np.array([-8.0, 15.0]), "x", INK, 14, "end")
        words = (
            "Dashed: what the scales say; blue: where",
            "the tip is. U4 counts each component of e(x).",
        )
    else:
        ends = [at(_bent(point)) for point in ((0.12, 0.2), (0.83, 0.7))]
        drawing.line(ends, WARM, 2.2)
        for end in ends:
            drawing.circle(end, 9, FILLS[WARM], WARM, "3 2")
            drawing.circle(end, 3.5, INK)
        drawing.text((ends[0] + ends[1]) / 2 + np.array([-14.0, -8.0]), "length", WARM, 14, "end")
        words = (
            "Two readings, each corrected by e(x). The",
            "choice of the frame does not matter.",
        )
    for number, line in enumerate(words):
        drawing.text((left - 10, 290 + 16 * number), line, NOTE, 11)


def _ball_panel(drawing: Drawing, left: float) -> None:
    places = [np.array([left + 15 + 45 * c, 250 - 45 * r]) for r in range(5) for c in range(5)]
    edge = ((-14, 14), (194, 14), (194, -194), (-14, -194))
    drawing.area([places[0] + np.array(offset) for offset in edge])
    ends = [places[1], places[19]]
    for place in places:
        drawing.circle(place, 7, "white", PLATE)
    drawing.line(ends, WARM, 2.2)
    for end in ends:
        drawing.circle(end, 11, FILLS[WARM], WARM, "3 2")
        drawing.circle(end, 3.5, INK)
    drawing.text((ends[0] + ends[1]) / 2 + np.array([-12.0, -4.0]), "distance", WARM, 14, "end")
    drawing.text((left - 10, 290), "On the artefact: U5 shows how well the", NOTE, 11)
    drawing.text((left - 10, 306), "plate itself becomes known.", NOTE, 11)


def overview() -> Drawing:
    """The quickstart: its six positions, and the uncertainties that they lead to."""
    drawing = Drawing(860, 400, "Six positions of a ball plate and the uncertainties predicted")
    experiment = ballplate.quickstart()
    drawing.text((20, 30), "The experiment: a ball plate in six positions", size=15, weight="bold")
    volume = Volume(drawing, (45, 335), 215)
    volume.back()
    for position in experiment.positions:
        volume.plate(position.pose, experiment.artefacts[position.artefact].layout(), 1.8)
    volume.front()
    drawing.arrow((405, 200), (465, 200), INK, 3)
    drawing.text((435, 185), "ballplate run", INK, 12, "middle")
    _bars(drawing, 490, experiment)
    return drawing


def _bars(drawing: Drawing, left: float, experiment: ballplate.Experiment) -> None:
    quantities = ballplate.run(experiment).quantities
    rows = (
        ("U1", "balls"),
        ("U4", "machine errors at a point"),
        ("U5", "distances between balls"),
        ("U6", "distances by the corrected machine"),
    )
    scale = 300 / 0.45
    drawing.text((left, 30), "The uncertainty it will achieve", size=15, weight="bold")
    for number, (symbol, words) in enumerate(rows):
        top = 62 + 72 * number
        average, maximum = (
            1e6 * value for value in (quantities[symbol].average, quantities[symbol].maximum)
        )
        drawing.text((left, top), f"{symbol}  {words}", size=13)
        box = ((0, 8), (1, 8), (1, 28), (0, 28))
        drawing.area([(left + scale * maximum * x, top + y) for x, y in box], PALE, 1)
        drawing.area([(left + scale * average * x, top + y) for x, y in box], PROBE, 1)
        drawing.text((left + scale * average - 5, top + 23), f"{average:.2f}", INK, 12, "end")
        drawing.text((left + scale * maximum + 5, top + 23), f"{maximum:.2f} µm", INK, 12)
    for line, words in enumerate(
        (
            "Standard uncertainty: average (blue) and largest (grey).",
            "Every reading repeats to 0.2 µm.",
        )
    ):
        drawing.text((left, 365 + 16 * line), words, NOTE, 12)


DRAWINGS = {
    "placement": placement,
    "arrangements": arrangements,
    "machines": machines,
    "uncertainties": uncertainties,
    "overview": overview,
}


def main() -> None:
    PICTURES.mkdir(exist_ok=True)
    for name, draw in DRAWINGS.items():
        (PICTURES / f"{name}.svg").write_text(draw().svg(), encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
