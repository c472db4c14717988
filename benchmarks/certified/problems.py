"""The certified problems: what each design is, before it is given readings and answers.

Numbers are short decimals. What they make up is written to `designs/certified` by `make.py`.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

Problem = dict[str, Any]
STAR = {
    "down": [0, 0, -0.05],
    "right": [0.05, 0, 0],
    "left": [-0.05, 0, 0],
    "back": [0, 0.05, 0],
    "front": [0, -0.05, 0],
}
# The axes that the first and the second axis of a plate lie along, in planes across x, y and z.
ALONG = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}
TIPS = {"x": ("right", "left"), "y": ("back", "front"), "z": ("down",)}
MICROMETRE = 1e-6


def problem(
    name: str, title: str, why: str, volume: list[list[float]], model: Problem, probes: Problem
) -> Problem:
    """A problem without artefacts, positions and readings."""
    return {
        "name": name,
        "title": title,
        "why": why,
        "dimension": len(volume[0]),
        "volume": {"lower": volume[0], "upper": volume[1]},
        "error_model": model,
        "probes": [
            {
                "name": key,
                "offset": offset,
                "free": False,
                "standard_uncertainty": None,
                "stated": offset,
            }
            for key, offset in probes.items()
        ],
        "artefacts": [],
        "positions": [],
        "readings": [],
        "distances": [],
        "coordinates": [],
        "lengths": [],
        "measured_lengths": [],
        "priors": [],
        "points": [],
        "point_probe": 0,
    }


def kinematic(position: int, rotation: int, rotations: str = "linearised") -> Problem:
    return {
        "kind": "kinematic",
        "rotations": rotations,
        "position_coefficients": position,
        "rotation_coefficients": rotation,
    }


def grid(columns: int, rows: int, width: float, height: float) -> list[list[float]]:
    return [
        [round(width * i / (columns - 1), 9), round(height * j / (rows - 1), 9), 0.0]
        for j, i in product(range(rows), range(columns))
    ]


def turned_in_plane(plane: str, turns: int) -> tuple[list[list[int]], list[int]]:
    """Matrix of a plate across an axis after quarter turns, and angles in degrees about fixed x,
    then y, then z.
    """
    first, second = ALONG[plane]
    frame = [[0] * 3 for _ in range(3)]
    axes = [(first, 1), (second, 1), (first, -1), (second, -1)]
    frame[axes[turns % 4][0]][0] = axes[turns % 4][1]
    frame[axes[(turns + 1) % 4][0]][1] = axes[(turns + 1) % 4][1]
    frame["xyz".index(plane)][2] = 1
    for angles in product((0, 90, 180, 270), repeat=3):
        if quarter_rotation(angles) == frame:
            return frame, list(angles)
    raise AssertionError(plane)


def quarter_rotation(angles: tuple[int, ...]) -> list[list[int]]:
    """Rz Ry Rx of multiples of 90 degrees, exactly."""
    (ca, sa), (cb, sb), (cc, sc) = (
        ((1, 0), (0, 1), (-1, 0), (0, -1))[angle // 90] for angle in angles
    )
    return [
        [cc * cb, cc * sb * sa - sc * ca, cc * sb * ca + sc * sa],
        [sc * cb, sc * sb * sa + cc * ca, sc * sb * ca - cc * sa],
        [-sb, cb * sa, cb * ca],
    ]


def add_plate_position(
    given: Problem, name: str, plane: str, level: float, corner: tuple[float, float], turns: int, tips: tuple[str, ...],
    uncertainty: list[float], balls: list[int] | None = None, artefact: int = 0, free: bool = True,
) -> None:  # fmt: skip
    """Stand a plate across an axis with the lower corner of its bounding rectangle at `corner`, and
    read it.
    """
    matrix, angles = turned_in_plane(plane, turns)
    first, second = ALONG[plane]
    every = given["artefacts"][artefact]["balls"]
    placed = [
        [sum(m * c for m, c in zip(row, ball, strict=True)) for row in matrix] for ball in every
    ]
    origin = [0.0] * 3
    for axis, at in ((first, corner[0]), (second, corner[1])):
        origin[axis] = round(at - min(ball[axis] for ball in placed), 9)
    origin["xyz".index(plane)] = level
    add_position(given, name, artefact, origin, angles, list(range(6)) if free else [])
    names = [probe["name"] for probe in given["probes"]]
    for ball in range(len(every)) if balls is None else balls:
        for tip in tips:
            read(given, ball, names.index(tip), uncertainty)


def add_position(
    given: Problem,
    name: str,
    artefact: int,
    origin: list[float],
    angles: list[float],
    free: list[int],
) -> None:
    given["positions"].append(
        {
            "name": name,
            "artefact": artefact,
            "origin": origin,
            "rotation_degrees": angles,
            "free": free,
        }
    )


def read(given: Problem, ball: int, probe: int, uncertainty: list[float]) -> int:
    """Read a ball in the last position; the number of the reading."""
    position = len(given["positions"]) - 1
    given["readings"].append(
        {
            "position": position,
            "ball": ball,
            "probe": probe,
            "standard_uncertainty": list(uncertainty),
        }
    )
    return len(given["readings"]) - 1


def add_plate(given: Problem, name: str, balls: list[list[float]], role: str = "plate") -> None:
    given["artefacts"].append({"name": name, "role": role, "balls": balls})


def add_distances(
    given: Problem, pairs: list[tuple[int, int]], uncertainty: float, artefact: int = 0
) -> None:
    balls = given["artefacts"][artefact]["balls"]
    for i, j in pairs:
        length = sum((u - v) ** 2 for u, v in zip(balls[i], balls[j], strict=True)) ** 0.5
        given["distances"].append(
            {
                "artefact": artefact,
                "balls": [i, j],
                "value": round(length, 9),
                "standard_uncertainty": uncertainty,
            }
        )


def add_coordinates(
    given: Problem, balls: list[int], uncertainty: float, artefact: int = 0
) -> None:
    for ball, axis in product(balls, range(given["dimension"])):
        given["coordinates"].append(
            {
                "artefact": artefact,
                "ball": ball,
                "axis": axis,
                "value": given["artefacts"][artefact]["balls"][ball][axis],
                "standard_uncertainty": uncertainty,
            }
        )


def add_points(given: Problem, shares: list[tuple[float, ...]]) -> None:
    lower, upper = given["volume"]["lower"], given["volume"]["upper"]
    given["points"] = [
        [
            round(low + share * (high - low), 9)
            for share, low, high in zip(point, lower, upper, strict=True)
        ]
        for point in shares
    ]


SPREAD = [
    (0.1, 0.2, 0.3), (0.9, 0.15, 0.25), (0.35, 0.85, 0.05), (0.6, 0.55, 0.95), (0.05, 0.7, 0.75), (0.8, 0.9, 0.6),
    (0.45, 0.05, 0.65), (1.0, 1.0, 1.0), (0.0, 0.4, 1.0), (0.7, 0.3, 0.5),
]  # fmt: skip
CUBE = [[0, 0, 0], [1, 1, 1]]
SIX = (
    ("z low", "z", 0.25, (0, 0), 0),
    ("z high", "z", 0.75, (0.4, 0.4), 1),
    ("x low", "x", 0.25, (0, 0), 1),
    ("x high", "x", 0.75, (0.4, 0.4), 0),
    ("y low", "y", 0.25, (0, 0), 0),
    ("y high", "y", 0.75, (0.4, 0.4), 1),
)
SIDES_OF_THREE = [(0, 2), (2, 8), (8, 6), (6, 0)]


def six_positions(given: Problem, uncertainty: list[float], hold_first: bool = True) -> None:
    for k, (name, plane, level, corner, turns) in enumerate(SIX):
        free = not hold_first or k > 0
        add_plate_position(
            given, name, plane, level, corner, turns, TIPS[plane], uncertainty, free=free
        )


def three_planes() -> Problem:
    given = problem(
        "three-planes",
        "A plate of 3 x 3 balls in six positions",
        "The ordinary case: four certified sides, a star probe, polynomials with three"
        " coefficients.",
        CUBE,
        kinematic(3, 3),
        STAR,
    )
    add_plate(given, "plate", grid(3, 3, 0.6, 0.6))
    six_positions(given, [2e-7] * 3)
    add_distances(given, SIDES_OF_THREE, 2e-7)
    add_points(given, SPREAD)
    return given


def certified_coordinates() -> Problem:
    given = problem(
        "certified-coordinates",
        "A plate with certified co-ordinates, all poses free",
        "The certificate supplies the frame; readings of three different uncertainties, by axis and"
        " by position.",
        [[-0.5, 0, -0.8], [0.5, 1.2, 0]],
        kinematic(4, 2),
        STAR,
    )
    add_plate(given, "plate", grid(4, 3, 0.6, 0.4))
    for k, (name, plane, level, corner, turns) in enumerate(
        (
            ("z low", "z", -0.6, (-0.4, 0.1), 0),
            ("z high", "z", -0.2, (-0.1, 0.5), 1),
            ("x left", "x", -0.25, (0.2, -0.7), 0),
            ("x right", "x", 0.3, (0.6, -0.7), 1),
            ("y front", "y", 0.3, (-0.7, -0.4), 0),
        )
    ):
        uncertainty = [3e-7, 2e-7, 5e-7] if k % 2 else [4e-7, 4e-7, 1e-6]
        add_plate_position(given, name, plane, level, corner, turns, TIPS[plane], uncertainty)
    add_coordinates(given, list(range(12)), 5e-7)
    add_points(given, SPREAD)
    return given


def full_rotations() -> Problem:
    given = problem(
        "full-rotations",
        "A machine with large errors, rotations multiplied out",
        "Errors of tenths of millimetres and milliradians: linearised rotations would be off by"
        " micrometres.",
        CUBE,
        kinematic(3, 2, "full"),
        STAR,
    )
    add_plate(given, "plate", grid(3, 3, 0.6, 0.6))
    six_positions(given, [2e-7] * 3)
    add_distances(given, SIDES_OF_THREE, 2e-7)
    add_points(given, SPREAD)
    given["errors"] = {"position": 2e-4, "rotation": 1e-3}
    return given


def unknown_offsets() -> Problem:
    given = problem(
        "unknown-offsets",
        "Probe offsets among the parameters",
        "Offsets with a standard uncertainty of 10 um but for the first; they trade against poses"
        " and errors.",
        CUBE,
        kinematic(3, 3),
        STAR,
    )
    for probe in given["probes"][1:]:
        probe.update(free=True, standard_uncertainty=1e-5)
    add_plate(given, "plate", grid(3, 3, 0.6, 0.6))
    for k, (name, plane, level, corner, turns) in enumerate(SIX):
        tips = TIPS[plane] if plane == "z" else (*TIPS[plane], "down")
        # Within the volume, whatever the offsets are found to be.
        within = tuple(round(0.1 + 0.5 * c, 9) for c in corner)
        add_plate_position(given, name, plane, level, within, turns, tips, [2e-7] * 3, free=k > 0)
    add_distances(given, SIDES_OF_THREE, 2e-7)
    add_points(given, SPREAD)
    return given


def tight_prior() -> Problem:
    given = three_planes()
    given.update(
        name="tight-prior",
        title="A coefficient known to a picometre beside readings of a millimetre",
        why="Weights that differ by nine orders of magnitude; nothing is undetermined.",
    )
    for reading in given["readings"]:
        reading["standard_uncertainty"] = [1e-3] * 3
    given["distances"] = []
    add_distances(given, SIDES_OF_THREE, 1e-6)
    given["priors"] = [{"parameter": "EXX t^1", "value": 0.0, "standard_uncertainty": 1e-12}]
    return given


def weak() -> Problem:
    given = problem(
        "weak",
        "A nearly symmetrical design",
        "The deficient design with one position turned by 0.2 degrees: lengths to 32 um from"
        " readings to 0.2 um.",
        CUBE,
        kinematic(3, 3),
        STAR,
    )
    add_plate(given, "plate", grid(3, 3, 0.75, 0.75))
    symmetrical(given)
    given["positions"][3]["rotation_degrees"][2] += 0.2
    add_distances(given, SIDES_OF_THREE, 2e-7)
    add_points(given, SPREAD)
    return given


def symmetrical(given: Problem) -> None:
    for k, (name, plane, level, turns) in enumerate(
        (
            ("z low", "z", 0.1, 0),
            ("z high", "z", 0.9, 0),
            ("x middle", "x", 0.5, 3),
            ("y middle", "y", 0.5, 1),
        )
    ):
        add_plate_position(
            given, name, plane, level, (0.125, 0.125), turns, TIPS[plane], [2e-7] * 3, free=k > 0
        )  # fmt: skip


def deficient() -> Problem:
    given = weak()
    given.update(
        name="deficient",
        title="Four symmetrical positions",
        why="Exactly deficient; what is averaged over the determined values alone shows itself.",
        planned_only=True,
    )
    given["positions"][3]["rotation_degrees"][2] -= 0.2
    given["positions"][3]["rotation_degrees"][2] = round(
        given["positions"][3]["rotation_degrees"][2]
    )
    return given


def few_positions() -> Problem:
    given = problem(
        "one-position",
        "Certified co-ordinates and a single position",
        "The plate is known and most of the machine is not: few uncertainties exist, and those are"
        " exact.",
        CUBE,
        kinematic(2, 2),
        STAR,
    )
    add_plate(given, "plate", grid(3, 3, 0.6, 0.6))
    add_plate_position(given, "upright", "x", 0.5, (0.2, 0.2), 0, ("right",), [3e-9] * 3)
    add_coordinates(given, list(range(9)), 1e-6)
    add_points(given, SPREAD)
    given["planned_only"] = True
    return given


METRIC = {"kind": "metric", "parameters": ["scale x", "scale y", "scale z", "C0Y", "B0Z", "A0Z"]}
MACHINE_OF_BARS = [[0, 0, 0], [1, 0.8, 0.6]]
BARS = (
    ("along x", [0.25, 0.2, 0.1], [0, 0, 0]),
    ("along x back", [0.25, 0.6, 0.4], [0, 0, 0]),
    ("along y", [0.3, 0.15, 0.1], [0, 0, 90]),
    ("along y right", [0.8, 0.15, 0.4], [0, 0, 90]),
    ("upright", [0.2, 0.2, 0.02], [0, -90, 0]),
    ("xy rising", [0.3, 0.2, 0.3], [0, 0, 45]),
    ("xy falling", [0.3, 0.6, 0.3], [0, 0, -45]),
    ("xz rising", [0.3, 0.4, 0.1], [0, -45, 0]),
    ("yz rising", [0.5, 0.2, 0.1], [0, -45, 90]),
    ("yz falling", [0.5, 0.2, 0.5], [0, 45, 90]),
)


def ball_bar() -> Problem:
    given = problem(
        "ball-bar",
        "Scales and squareness from a ball bar",
        "Lengths between corrected points; the certificate's error is one parameter, wherever the"
        " bar is read.",
        MACHINE_OF_BARS,
        METRIC,
        {"cone": [0, 0, -0.06]},
    )
    add_plate(given, "bar", [[0, 0, 0], [0.5, 0, 0]], "length_standard")
    add_length(given, "bar", 0.5, 5e-7)
    for name, origin, angles in BARS:
        add_position(given, name, 0, origin, angles, [])
        first, second = (read(given, ball, 0, [1e-6] * 3) for ball in (0, 1))
        # The same along all axes, so that the direction does not matter.
        add_measured(given, first, second, round(2e-12**0.5, 21))
    add_points(given, SPREAD)
    return given


def add_length(given: Problem, name: str, nominal: float, uncertainty: float | None) -> None:
    given["lengths"].append(
        {
            "name": name,
            "nominal": nominal,
            "value": nominal,
            "standard_uncertainty": uncertainty,
            "free": True,
        }
    )


def add_measured(given: Problem, first: int, second: int | None, uncertainty: float) -> None:
    given["measured_lengths"].append(
        {"first": first, "second": second, "length": 0, "standard_uncertainty": uncertainty}
    )


def bars_in_a_plane() -> Problem:
    given = ball_bar()
    given.update(
        name="bars-in-a-plane",
        title="A ball bar that is never raised",
        why="Z, and the squareness of Z to X and Y, are open; X, Y and their squareness are not.",
        planned_only=True,
    )
    flat = [k for k, (_, _, angles) in enumerate(BARS) if angles[1] == 0]
    given["positions"] = [given["positions"][k] for k in flat]
    given["readings"] = [
        {**given["readings"][2 * k + end], "position": place}
        for place, k in enumerate(flat)
        for end in (0, 1)
    ]
    given["measured_lengths"] = [
        {**given["measured_lengths"][k], "first": 2 * place, "second": 2 * place + 1}
        for place, k in enumerate(flat)
    ]
    return given


DIRECTIONS = [
    [azimuth, elevation]
    for elevation in (5, 35, 65)
    for azimuth in (0, 45, 90, 135, 180, 225, 270, 315)
]


def bryan_gauge() -> Problem:
    given = problem(
        "bryan-gauge",
        "A Bryan gauge with a certified radius",
        "Only the moving ball is read; the place of the pivot is estimated.",
        MACHINE_OF_BARS,
        METRIC,
        {"magnet": [0, 0, 0]},
    )
    add_plate(given, "gauge", [], "gauge")
    given["artefacts"][0]["directions_degrees"] = DIRECTIONS
    add_length(given, "gauge", 0.3, 5e-7)
    add_position(given, "pivot", 0, [0.5, 0.4, 0.1], [0, 0, 0], [0, 1, 2])
    for ball in range(len(DIRECTIONS)):
        add_measured(given, read(given, ball, 0, [1e-6] * 3), None, 1e-6)
    add_points(given, SPREAD)
    return given


def unknown_radius() -> Problem:
    given = bryan_gauge()
    given.update(
        name="bryan-gauge-unknown-radius",
        title="A Bryan gauge whose radius nobody knows",
        why="The overall scale is open: five of the six parameters' combinations are not.",
        planned_only=True,
    )
    given["lengths"][0]["standard_uncertainty"] = None
    return given


def two_dimensions() -> Problem:
    given = problem(
        "two-dimensions",
        "A plate in two positions a quarter turn apart",
        "The reversal of NBSIR 79-1752 as a least-squares problem: squareness and difference of"
        " scales.",
        [[-0.05, -0.4], [0.4, 0.4]],
        {"kind": "metric", "parameters": ["alpha", "gamma"]},
        {"probe": [0, 0]},
    )
    balls = [
        [0, 0],
        [0.32, 0],
        [0.08, 0.07],
        [0.004, 0.3],
        [0.3, 0.35],
        [0.18, 0.18],
        [0.31, 0.25],
        [0.03, 0.1],
    ]
    add_plate(given, "plate", balls)
    add_position(given, "turned", 0, [0, 0], [-90], [])
    for ball in range(len(balls)):
        read(given, ball, 0, [1e-7, 1e-7])
    add_position(given, "first", 0, [0, 0], [0], [0, 1, 2])
    for ball in range(len(balls)):
        read(given, ball, 0, [1e-7, 1e-7])
    add_points(given, [(a, b) for a in (0.0, 0.3, 1.0) for b in (0.1, 0.6, 0.9)])
    return given


PROBLEMS: tuple[Callable[[], Problem], ...] = (
    three_planes,
    certified_coordinates,
    full_rotations,
    unknown_offsets,
    tight_prior,
    weak,
    deficient,
    few_positions,
    ball_bar,
    bars_in_a_plane,
    bryan_gauge,
    unknown_radius,
    two_dimensions,
)
