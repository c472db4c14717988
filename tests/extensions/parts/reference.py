"""A bearing block on machines, computed anew: its points, fits and dimensions, errors of chains of
axes, and least squares of campaigns, all dense. Of the package only arrays of a design are read.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import yaml
from numpy.polynomial.chebyshev import chebval
from scipy.optimize import least_squares, minimize
from scipy.spatial.transform import Rotation

from tests.reference import dense

ROOT = Path(__file__).parents[3]
DIAMETER, STRAIN = 0.004, 11.5e-6
TOLERANCES = {
    "diameter bore 1": "{diameter: bore 1, tolerance: [0, 21 um]}",
    "diameter ball": "{diameter: ball, tolerance: 10 um}",
    "diameter pin hole": "{diameter: pin hole}",
    "radius corner": "{radius: corner, tolerance: 0.05}",
    "distance bore 1, bore 2": "{distance: [bore 1, bore 2], tolerance: 20 um}",
    "distance C, right": "{distance: [C, right], tolerance: 30 um}",
    "distance bore 1, cross": "{distance: [bore 1, cross]}",
    "distance A, ball": "{distance: [A, ball]}",
    "distance ball, pin hole": "{distance: [ball, pin hole]}",
    "angle A, B": "{angle: [A, B], tolerance: 0.1 mrad}",
    "angle bore 1, cross": "{angle: [bore 1, cross]}",
    "flatness A": "{flatness: A, tolerance: 8 um, nominal: 3 um}",
    "straightness edge": "{straightness: edge, tolerance: 6 um}",
    "roundness pin hole": "{roundness: pin hole, tolerance: 4 um, evaluation: minimum zone}",
    "cylindricity bore 2": "{cylindricity: bore 2, tolerance: 6 um}",
    "parallelism right": "{parallelism: right, datums: C, tolerance: 15 um}",
    "parallelism bore 2": "{parallelism: bore 2, datums: bore 1, tolerance: 10 um}",
    "perpendicularity B": "{perpendicularity: B, datums: A, tolerance: 10 um}",
    "perpendicularity bore 1": "{perpendicularity: bore 1, datums: A, tolerance: 10 um}",
    "position bore 2": "{position: bore 2, datums: [A, B, C], tolerance: 20 um}",
    "position ball": "{position: ball, datums: [A, B, C], tolerance: 30 um}",
    "position countersink": "{position: countersink, datums: [A, bore 1, bore 2], tolerance: 0.1}",
}
LINEAR = list(TOLERANCES)[:11]
GROUPED = list(TOLERANCES)[11:]
QUICK = {"low": ([0.15, 0.15, 0.1], 0), "turned": ([0.7, 0.7, 0.75], 1)}
BRIDGE = {"low": ([0.12, 0.2, 0.15], 0), "turned": ([0.7, 0.8, 0.45], 1)}
# Axes from the ground outwards, on the probe's and on the workpiece's side.
CHAINS = {
    "MB1": ("yxz", ""),
    "MB2": ("xyz", ""),
    "FB1": ("xz", "y"),
    "FH2": ("xz", "y"),
    "MH1": ("yzx", ""),
    "CX1": ("z", "xy"),
}


def part_text(
    places: dict[str, Any] = QUICK,
    point: str = "0.4 um",
    tip: str = "0.1 um",
    form: str = "0.3 um",
    kelvin: float = 0.1,
    celsius: float = 23.0,
    waves: str = "",
    names: list[str] | None = None,
) -> str:
    """A part file of the block; numbers are in millimetres."""
    where = "\n".join(
        f"  {name}: {{origin: {[1e3 * one for one in origin]}, quarter_turns: {turns}}}"
        for name, (origin, turns) in places.items()
    )
    dimensions = "\n".join(f"  - {TOLERANCES[name]}" for name in names or TOLERANCES)
    return f"""\
part: block
material: {{expansion: 11.5 um/m/K, temperature: {celsius} degC, standard_uncertainty: {kelvin} K}}
probing: {{point_repeatability: {point}, tip: {{diameter: 4, standard_uncertainty: {tip}}}, form: {form}}}
{waves}
places:
{where}
features:
  A: {{plane: z+, at: 60, from: [10, 8], to: [190, 142], points: [4, 3]}}
  B: {{plane: y-, at: 0, from: [15, 15], to: [185, 50], points: [4, 2]}}
  C: {{plane: x-, at: 0, from: [15, 15], to: [135, 45], points: [3, 2], probe: right}}
  right: {{plane: x+, at: 200, from: [15, 15], to: [95, 45], points: [3, 2], probe: left}}
  edge: {{line: x, on: B, at: {{z: 30}}, from: 20, to: 180, points: 5}}
  bore 1: {{bore: z, at: [50, 40], diameter: 30, depths: [8, 48], points: 8}}
  bore 2: {{bore: z, at: [150, 105], diameter: 30, depths: [8, 48], points: 8}}
  pin hole: {{bore: z, at: [100, 75], diameter: 12, depths: 50, points: 6}}
  countersink: {{cone: z+, apex: [100, 75, 52], angle: 90 deg, depths: [6.5, 7.5], points: 6}}
  cross: {{bore: y, at: [100, 30], diameter: 20, depths: [5, 25], points: 6}}
  corner: {{arc: z, at: [160, 110], radius: 40, from: 15 deg, to: 75 deg, depth: 20, points: 5}}
  ball: {{sphere: [165, 30, 80], diameter: 25, points: 9, probe: front}}
dimensions:
{dimensions}
"""


# Probes of features: stated, or the first that touches the bore across from both ends.
PROBES = {"C": "right", "right": "left", "ball": "front"}
ACROSS = {"low": "back", "turned": "right"}


def surface() -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Points (n, 3) of the features in metres, and normals (n, 3) away from the material."""

    def face(x: Any, y: Any, z: Any, normal: list[float]) -> tuple[np.ndarray, np.ndarray]:
        points = [
            [a, b, c] for c in np.atleast_1d(z) for b in np.atleast_1d(y) for a in np.atleast_1d(x)
        ]
        return 1e-3 * np.array(points, float), np.tile(np.array(normal, float), (len(points), 1))

    def ring(count: int) -> tuple[np.ndarray, np.ndarray]:
        angles = 2 * np.pi * np.arange(count) / count
        return np.cos(angles), np.sin(angles)

    def bore(x: float, y: float, radius: float, depths: list[float], count: int) -> Any:
        c, s = ring(count)
        normals = np.tile(np.stack([-c, -s, 0 * c], axis=1), (len(depths), 1))
        middle = [[x, y, z] for z in depths for _ in range(count)]
        return 1e-3 * (np.array(middle) - radius * normals), normals

    found = {
        "A": face([10, 70, 130, 190], [8, 75, 142], 60, [0, 0, 1]),
        "B": face([15, 215 / 3, 385 / 3, 185], 0, [15, 50], [0, -1, 0]),
        "C": face(0, [15, 75, 135], [15, 45], [-1, 0, 0]),
        "right": face(200, [15, 55, 95], [15, 45], [1, 0, 0]),
        "edge": face([20, 60, 100, 140, 180], 0, 30, [0, -1, 0]),
        "bore 1": bore(50, 40, 15, [8, 48], 8),
        "bore 2": bore(150, 105, 15, [8, 48], 8),
        "pin hole": bore(100, 75, 6, [50], 6),
    }
    c, s = ring(6)
    points, normals = [], []
    for depth in (6.5, 7.5):
        for cos, sin in zip(c, s, strict=True):
            points.append([100 + depth * cos, 75 + depth * sin, 52 + depth])
            normals.append(np.array([-cos, -sin, 1]) / np.sqrt(2))
    found["countersink"] = 1e-3 * np.array(points), np.array(normals)
    points, normals = [], []
    for depth in (5, 25):
        for cos, sin in zip(c, s, strict=True):
            points.append([100 + 10 * cos, depth, 30 + 10 * sin])
            normals.append([-cos, 0, -sin])
    found["cross"] = 1e-3 * np.array(points), np.array(normals)
    angles = np.radians([15, 30, 45, 60, 75])
    normals = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    found["corner"] = 1e-3 * (np.array([160, 110, 20]) + 40 * normals), normals
    golden, up = np.pi * (3 - np.sqrt(5)) * np.arange(9), 1 - np.arange(9) / 8
    across = np.sqrt(1 - up**2)
    normals = np.stack([across * np.cos(golden), across * np.sin(golden), up], axis=1)
    found["ball"] = 1e-3 * (np.array([165, 30, 80]) + 12.5 * normals), normals
    return found


SURFACE = surface()
FEATURES = list(SURFACE)
NORMALS = np.concatenate([SURFACE[name][1] for name in FEATURES])
POINTS = np.concatenate([SURFACE[name][0] for name in FEATURES])
CENTRES = POINTS + DIAMETER / 2 * NORMALS
OF = np.repeat(FEATURES, [len(SURFACE[name][0]) for name in FEATURES])


def probes_of(place: str) -> list[str]:
    """The probe of each point."""
    return [ACROSS[place] if one == "cross" else PROBES.get(one, "down") for one in OF]


def placed(place: tuple[list[float], int]) -> tuple[np.ndarray, np.ndarray]:
    origin, turns = place
    return Rotation.from_euler("z", 90 * turns, degrees=True).as_matrix(), np.array(origin)


# Fits, in millimetres.


def _solved(distances: Any, start: Any) -> np.ndarray:
    found = least_squares(
        distances, start, jac="3-point", method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    return np.asarray(found.x)


def _plane(x: np.ndarray, normal: np.ndarray) -> dict[str, Any]:
    middle = x.mean(axis=0)
    out = np.linalg.svd(x - middle)[2][2]
    out = out * np.sign(out @ normal)
    return {"centre": middle, "direction": out, "residuals": (x - middle) @ out, "x": x}


def _line(x: np.ndarray) -> dict[str, Any]:
    flat = x[:, :2] - x[:, :2].mean(axis=0)
    across = np.linalg.svd(flat)[2][1]
    return {"residuals": flat @ across * -np.sign(across[1])}


def _circle(x: np.ndarray, centre: Any, radius: float) -> dict[str, Any]:
    p = _solved(
        lambda p: np.hypot(x[:, 0] - p[0], x[:, 1] - p[1]) - p[2], [centre[0], centre[1], radius]
    )
    return {"centre": np.array([p[0], p[1], x[:, 2].mean()]), "radius": p[2], "x": x}


def _cylinder(x: np.ndarray, axis: int, radius: float) -> dict[str, Any]:
    first, second = [k for k in range(3) if k != axis]
    middle = x.mean(axis=0)

    def parts(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        direction, centre = np.zeros(3), middle.copy()
        direction[[first, second, axis]] = [p[2] / 100, p[3] / 100, 1.0]
        centre[[first, second]] += p[:2]
        return centre, direction / np.linalg.norm(direction)

    def distances(p: np.ndarray) -> np.ndarray:
        centre, direction = parts(p)
        return np.asarray(np.linalg.norm(np.cross(x - centre, direction), axis=1) - p[4])

    p = _solved(distances, [0, 0, 0, 0, radius])
    centre, direction = parts(p)
    centre = centre + ((middle - centre) @ direction) * direction
    return {"centre": centre, "direction": direction, "radius": p[4], "residuals": distances(p)}


def _sphere(x: np.ndarray, centre: Any, radius: float) -> dict[str, Any]:
    p = _solved(lambda p: np.linalg.norm(x - p[:3], axis=1) - p[3], [*centre, radius])
    return {"centre": p[:3], "radius": p[3]}


def _cone(x: np.ndarray) -> dict[str, Any]:
    """By its apex, which differs from that of the surface, slopes and half-angle."""

    def distances(p: np.ndarray) -> np.ndarray:
        direction = np.array([p[3] / 100, p[4] / 100, 1.0])
        direction /= np.linalg.norm(direction)
        along = (x - p[:3]) @ direction
        across = np.linalg.norm(np.cross(x - p[:3], direction), axis=1)
        return np.asarray(across * np.cos(p[5]) - along * np.sin(p[5]))

    p = _solved(distances, [100, 75, 52 + 2 * np.sqrt(2), 0, 0, np.pi / 4])
    direction = np.array([p[3] / 100, p[4] / 100, 1.0])
    return {"centre": p[:3], "direction": direction / np.linalg.norm(direction)}


def fit(name: str, metres: np.ndarray) -> dict[str, Any]:
    """The element of a feature through centres of tips (n, 3)."""
    x, r = 1e3 * metres, 500 * DIAMETER
    if name in ("A", "B", "C", "right"):
        return _plane(x, SURFACE[name][1][0])
    if name == "edge":
        return _line(x)
    if name in ("pin hole", "corner"):
        centre, radius = ([100, 75], 6 - r) if name == "pin hole" else ([160, 110], 40 + r)
        return _circle(x, centre, radius)
    if name == "ball":
        return _sphere(x, [165, 30, 80], 12.5 + r)
    if name == "countersink":
        return _cone(x)
    return _cylinder(x, 1 if name == "cross" else 2, (10 if name == "cross" else 15) - r)


def fits(centres: np.ndarray) -> dict[str, dict[str, Any]]:
    return {name: fit(name, centres[name == OF]) for name in FEATURES}


def _across(vector: np.ndarray, direction: np.ndarray) -> np.ndarray:
    return np.asarray(vector - (vector @ direction) * direction)


def _pierced(one: dict[str, Any], frame: np.ndarray, origin: np.ndarray, z: float) -> np.ndarray:
    """Where an axis is at a height z of a frame, x and y."""
    centre, direction = frame @ (one["centre"] - origin), frame @ one["direction"]
    return np.asarray((centre + (z - centre[2]) / direction[2] * direction)[:2])


def members(f: dict[str, dict[str, Any]]) -> dict[str, np.ndarray]:
    """Deviations of sizes, distances and angles, and members of the others, in m or rad."""
    r = 500 * DIAMETER
    between = {
        pair: f[pair[1]]["centre"] - f[pair[0]]["centre"]
        for pair in (
            ("bore 1", "bore 2"),
            ("C", "right"),
            ("bore 1", "cross"),
            ("A", "ball"),
            ("ball", "pin hole"),
        )
    }
    out = {
        name: f[name]["direction"] for name in ("A", "B", "C", "right", "bore 1", "bore 2", "cross")
    }
    across = between["C", "right"]
    found = {
        "diameter bore 1": 2 * (f["bore 1"]["radius"] + r) - 30,
        "diameter ball": 2 * (f["ball"]["radius"] - r) - 25,
        "diameter pin hole": 2 * (f["pin hole"]["radius"] + r) - 12,
        "radius corner": f["corner"]["radius"] - r - 40,
        "distance bore 1, bore 2": np.hypot(*between["bore 1", "bore 2"][:2]) - np.hypot(100, 65),
        "distance C, right": (across @ out["right"] - across @ out["C"]) / 2 - 2 * r - 200,
        "distance bore 1, cross": abs(between["bore 1", "cross"][0]) - 50,
        "distance A, ball": between["A", "ball"] @ out["A"] + r - 20,
        "distance ball, pin hole": np.hypot(*between["ball", "pin hole"][:2]) - np.hypot(65, 45),
        "angle A, B": 1e3 * (np.arcsin(-(out["A"] @ -out["B"]))),
        "angle bore 1, cross": 1e3 * (np.arccos(out["bore 1"] @ out["cross"]) - np.pi / 2),
        "flatness A": f["A"]["residuals"],
        "straightness edge": f["edge"]["residuals"],
        "roundness pin hole": np.linalg.norm(
            (f["pin hole"]["x"] - f["pin hole"]["centre"])[:, :2], axis=1
        )
        - f["pin hole"]["radius"],
        "cylindricity bore 2": f["bore 2"]["residuals"],
        "parallelism right": f["right"]["x"] @ out["C"],
        "parallelism bore 2": 40 * _across(out["bore 2"], out["bore 1"]),
        "perpendicularity B": f["B"]["x"]
        @ (one := _across(out["B"], out["A"]))
        / np.linalg.norm(one),
        "perpendicularity bore 1": 40 * _across(out["bore 1"], out["A"]),
    }
    y = -_across(out["B"], out["A"])
    y /= np.linalg.norm(y)
    frame = np.stack([np.cross(y, out["A"]), y, out["A"]])
    origin = frame.T @ np.array(
        [
            frame[0] @ f["C"]["centre"] + r,
            frame[1] @ f["B"]["centre"] + r,
            frame[2] @ f["A"]["centre"] - 60 - r,
        ]
    )
    found["position bore 2"] = np.stack(
        [_pierced(f["bore 2"], frame, origin, z) - [150, 105] for z in (8, 48)]
    )
    found["position ball"] = (frame @ (f["ball"]["centre"] - origin) - [165, 30, 80])[None]
    along = _across(between["bore 1", "bore 2"], out["A"])
    angle = np.arctan2(65, 100)
    along /= np.linalg.norm(along)
    x = np.cos(angle) * along - np.sin(angle) * np.cross(out["A"], along)
    frame = np.stack([x, np.cross(out["A"], x), out["A"]])
    middle = f["bore 1"]["centre"]
    origin = frame.T @ np.array(
        [frame[0] @ middle - 50, frame[1] @ middle - 40, frame[2] @ f["A"]["centre"] - 60 - r]
    )
    found["position countersink"] = np.stack(
        [_pierced(f["countersink"], frame, origin, z) - [100, 75] for z in (58.5, 59.5)]
    )
    return {name: 1e-3 * np.asarray(found[name]) for name in TOLERANCES}


def values(name: str, of_members: np.ndarray) -> np.ndarray:
    """Values (b,) of a dimension from its members (b, k)."""
    if name in LINEAR:
        return of_members[:, 0]
    if name.startswith("position"):
        vectors = of_members.reshape(len(of_members), *((1, 3) if name[-4:] == "ball" else (2, 2)))
        return np.asarray(2 * np.linalg.norm(vectors, axis=2).max(axis=1))
    if of_members.shape[1] == 3:
        return np.linalg.norm(of_members, axis=1)
    return np.asarray(np.ptp(of_members, axis=1))


def zone(x: np.ndarray) -> float:
    """Minimum zone of a circle through points (n, 3)."""
    flat = 1e6 * (x[:, :2] - x[:, :2].mean(axis=0))
    found = minimize(
        lambda p: np.ptp(np.hypot(*(flat - p).T)),
        [0.0, 0.0],
        method="Nelder-Mead",
        options={"xatol": 1e-7, "fatol": 1e-9, "maxiter": 4000},
    )
    return 1e-6 * float(found.fun)


def dimensions(centres: np.ndarray) -> dict[str, float]:
    """Values of all dimensions from centres of tips (n, 3) near their places in the part."""
    found = {
        name: float(values(name, one.reshape(1, -1))[0])
        for name, one in members(fits(centres)).items()
    }
    return found | {"roundness pin hole": zone(centres[OF == "pin hole"])}


@cache
def slopes() -> dict[str, np.ndarray]:
    """Derivatives (k, n) of the members by displacements of all points along their normals."""
    start, columns = fits(CENTRES), []
    for k, normal in enumerate(NORMALS):
        name, some, ends = OF[k], OF[k] == OF, []
        step = 1e-7 if name == "countersink" else 1e-6
        for sign in (1.0, -1.0):
            centres = CENTRES.copy()
            centres[k] += sign * step * normal
            ends.append(members(start | {name: fit(name, centres[some])}))
        columns.append({one: (ends[0][one] - ends[1][one]).ravel() / (2 * step) for one in ends[0]})
    return {name: np.stack([one[name] for one in columns], axis=1) for name in TOLERANCES}


def aligned(centres: np.ndarray) -> np.ndarray:
    """Measured centres moved to be nearest to the nominal ones."""
    here, there = centres.mean(axis=0), CENTRES.mean(axis=0)
    turn, _ = Rotation.align_vectors(CENTRES - there, centres - here)
    return np.asarray(turn.apply(centres - here) + there)


# Machines.


@dataclass(frozen=True)
class Machine:
    """Errors of a chain of axes, products of errors neglected; coefficients by Chebyshev
    polynomials, times t, or t (1 - t) where an end of a straightness is held.
    """

    chain: tuple[str, str]
    lower: np.ndarray
    upper: np.ndarray
    counts: tuple[int, int]

    @property
    def functions(self) -> list[tuple[int, int, bool, int]]:
        """Axis, component, whether it turns, and number of coefficients, in their order."""
        held = ((0, 1), (0, 2), (1, 2))
        return [
            (
                axis,
                component,
                turns,
                self.counts[turns] - 1 - (not turns and (axis, component) in held),
            )
            for turns in (False, True)
            for axis in range(3)
            for component in range(3)
        ]

    @property
    def size(self) -> int:
        return sum(count for *_, count in self.functions)

    def error(self, x: Any, a: Any, p: Any) -> Any:
        """Tip less scale reading at scale readings x (m, 3), with offsets p (m, 3)."""
        t, away = (x - self.lower) / (self.upper - self.lower), x - self.lower
        shift = np.zeros((3, len(x), 3), np.result_type(x, a, p))
        turn, start = np.zeros_like(shift), 0
        for axis, component, turns, count in self.functions:
            s = t[:, axis]
            factor = s if turns or count == self.counts[0] - 1 else s * (1 - s)
            series = chebval(2 * s - 1, a[start : start + count]) if count else 0.0
            (turn if turns else shift)[axis, :, component] = factor * series
            start += count
        total = p + shift.sum(axis=0)
        probe_side, table_side = (["xyz".index(one) for one in side] for side in self.chain)
        behind = np.array(p, dtype=total.dtype)
        for axis in reversed(probe_side):
            total = total + np.cross(turn[axis], behind)
            behind[:, axis] += away[:, axis]
        for axis in table_side:
            behind[:, axis] += away[:, axis]
            total = total - np.cross(turn[axis], behind)
        return total

    def readings(self, tips: np.ndarray, a: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Scale readings (m, 3) of tips (m, 3)."""
        x = tips - p
        for _ in range(20):
            x = tips - self.error(x, a, p)
        return x


def machine_of(told: dict[str, Any]) -> Machine:
    """The machine of a mapping as in a file."""
    volume = told["machine"]["volume"]
    model = told["error_model"]
    upper = np.array([_metres(one) for one in volume])
    counts = model["position_coefficients"], model["rotation_coefficients"]
    return Machine(CHAINS[model["arrangement"]], 0 * upper, upper, counts)


def _metres(text: str) -> float:
    number, unit = text.split()
    return float(number) * {"m": 1.0, "mm": 1e-3}[unit]


@dataclass(frozen=True)
class Campaign:
    """A campaign of a design whose parameters are balls, free poses, the machine's coefficients and
    free offsets, in this order, at a point; `x` (m, 3) are scale readings.
    """

    design: Any
    machine: Machine
    x: np.ndarray
    balls: np.ndarray
    rotations: np.ndarray
    origins: np.ndarray
    a: np.ndarray
    offsets: np.ndarray
    certified: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def sizes(self) -> list[int]:
        free = int((~self.design.positions.held).sum())
        return [self.balls.size, free, len(self.a), int(self.design.probes.free.sum())]

    def at(self, step: Any) -> tuple[Any, Any, Any, Any, Any]:
        """Balls, rotations, origins, coefficients and offsets after a step."""
        ball, pose, a, offset = np.split(step, np.cumsum(self.sizes)[:-1])
        poses = np.zeros((len(self.origins), 6), step.dtype)
        poses[~self.design.positions.held] = pose
        offsets = self.offsets.astype(step.dtype)
        offsets[self.design.probes.free] += offset
        return (
            self.balls + ball.reshape(-1, 3),
            dense.turned(poses[:, 3:], self.rotations),
            self.origins + poses[:, :3],
            self.a + a,
            offsets,
        )

    def corrected(self, step: Any, x: np.ndarray, probes: Any) -> Any:
        """Corrected points (m, 3) for scale readings with probes of indices (m,)."""
        *_, a, offsets = self.at(step)
        return x + self.machine.error(x, a, offsets[probes])

    def residuals(self, step: Any) -> Any:
        balls, rotations, origins, _, offsets = self.at(step)
        own = self.design.readings
        tips = self.corrected(step, self.x, own.probe)
        true = np.einsum("mij,mj->mi", rotations[own.position], balls[own.ball])
        misfit = (tips - true - origins[own.position]) / self.design.machine.repeatability
        given = dense.known(self.design, "distance")
        lengths = dense.length(balls[given.first] - balls[given.second])
        prior = dense.known(self.design, "prior")
        stated = offsets[prior.probe, prior.component] - prior.value
        return np.concatenate(
            [
                misfit.ravel(),
                (lengths - self.certified) / given.uncertainty,
                stated / prior.uncertainty,
            ]
        )

    @property
    def spread(self) -> dense.Spread:
        return dense.spread(dense.jacobian(self.residuals, sum(self.sizes)))

    def fitted(self) -> tuple[Campaign, float]:
        """The campaign at its least squares, and the standard deviation of unit weight."""
        here = self
        for _ in range(5):
            rows = dense.jacobian(here.residuals, sum(self.sizes))
            size = np.linalg.norm(rows, axis=0)
            left = here.residuals(np.zeros(sum(self.sizes)))
            step = -np.linalg.lstsq(rows / size, left, rcond=None)[0] / size
            here = replace(
                here,
                **dict(
                    zip(
                        ("balls", "rotations", "origins", "a", "offsets"),
                        here.at(step),
                        strict=True,
                    )
                ),
            )
        left = here.residuals(np.zeros(sum(self.sizes)))
        return here, float(np.sqrt(left @ left / (len(left) - sum(self.sizes))))


def planned(design: Any, machine: Machine) -> Campaign:
    """A campaign before it is measured, of a machine without errors."""
    own, where = design.readings, design.positions
    true = np.einsum("mij,mj->mi", where.rotations[own.position], design.balls.places[own.ball])
    given = dense.known(design, "distance")
    return Campaign(
        design,
        machine,
        true + where.origins[own.position] - design.probes.offsets[own.probe],
        design.balls.places,
        where.rotations,
        where.origins,
        np.zeros(machine.size),
        design.probes.offsets,
        given.value,
    )


def quick() -> dict[str, Any]:
    return dict(yaml.safe_load((ROOT / "designs" / "quickstart.yaml").read_text(encoding="utf-8")))


def bridge(arrangement: str = "MB1", counts: tuple[int, int] = (4, 4)) -> dict[str, Any]:
    """A bridge of 900 x 1200 x 700 mm, tips with uncertain offsets."""
    told = quick()
    told["machine"] = {"volume": ["900 mm", "1200 mm", "700 mm"], "repeatability": "0.3 um"}
    told["error_model"] = {
        "kind": "kinematic",
        "arrangement": arrangement,
        "position_coefficients": counts[0],
        "rotation_coefficients": counts[1],
    }
    told["artefacts"] = {"plate": {"kind": "grid", "balls": [4, 4], "size": ["480 mm", "480 mm"]}}
    told["probes"] = {
        name: offset if name == "down" else {"offset": offset, "standard_uncertainty": "0.5 um"}
        for name, offset in told["probes"].items()
    }
    # Edges of the plate are on the way of both axes of each plane.
    told["positions"] = [
        {**one, "level": "low" if one["name"].endswith("low") else "high"}
        for one in told["positions"]
    ] + [
        {
            "name": "z middle",
            "plane": "z",
            "level": "50 %",
            "corner": {"x": "50 %", "y": "high"},
            "probes": ["down"],
        },
        {
            "name": "x middle",
            "plane": "x",
            "level": "50 %",
            "corner": {"y": "high", "z": "low"},
            "probes": ["right", "left"],
        },
        {
            "name": "y middle",
            "plane": "y",
            "level": "50 %",
            "corner": {"z": "low", "x": "high"},
            "probes": ["back", "front"],
        },
    ]
    return told


def drawn_truth(plan: Campaign, rng: np.random.Generator, errors: float = 2e-6) -> Campaign:
    """A true machine, plate, set-up and tips within the stated uncertainties, with the noise of
    its readings.
    """
    design, free = plan.design, plan.design.probes.free
    counts = [count for *_, count in plan.machine.functions]
    sizes = [errors * (2.0 if turns else 1.0) for _, _, turns, _ in plan.machine.functions]
    a = rng.normal(size=plan.machine.size) * np.repeat(sizes, counts)
    given, prior = dense.known(design, "distance"), dense.known(design, "prior")
    balls = plan.balls + 2e-6 * rng.normal(size=plan.balls.shape)
    # Certified distances of this plate are the stated ones, each with its error.
    wanted = plan.certified + given.uncertainty * rng.normal(size=len(plan.certified))
    for _ in range(4):
        rows = np.zeros((len(wanted), *balls.shape))
        between = balls[given.first] - balls[given.second]
        length = np.linalg.norm(between, axis=1)
        k = np.arange(len(wanted))
        rows[k, given.first] = between / length[:, None]
        rows[k, given.second] = -between / length[:, None]
        move = np.linalg.lstsq(rows.reshape(len(wanted), -1), wanted - length, rcond=None)[0]
        balls = balls + move.reshape(balls.shape)
    offsets = plan.offsets.copy()
    offsets[prior.probe, prior.component] += prior.uncertainty * rng.normal(size=len(prior.probe))
    assert (free == (offsets != plan.offsets)).all()
    poses = np.where(design.positions.held, 0.0, 1e-4 * rng.normal(size=(len(plan.origins), 6)))
    rotations = Rotation.from_rotvec(poses[:, 3:]).as_matrix() @ plan.rotations
    origins = plan.origins + poses[:, :3]
    own = design.readings
    tips = np.einsum("mij,mj->mi", rotations[own.position], balls[own.ball]) + origins[own.position]
    x = plan.machine.readings(tips, a, offsets[own.probe])
    x = x + design.machine.repeatability * rng.normal(size=x.shape)
    return replace(
        plan, x=x, balls=balls, rotations=rotations, origins=origins, a=a, offsets=offsets
    )


def table_of(campaign: Campaign) -> pandas.DataFrame:
    """Its readings as the package takes them."""
    design, own = campaign.design, campaign.design.readings
    names = {
        "position": [design.positions.names[k] for k in own.position],
        "ball": [design.balls.names[b] for b in own.ball],
        "probe": [design.probes.names[p] for p in own.probe],
    }
    columns = dict(zip(("x_mm", "y_mm", "z_mm"), 1e3 * campaign.x.T, strict=True))
    return pandas.DataFrame(names | columns)


def rows_of(place: str, x: np.ndarray) -> list[tuple[Any, ...]]:
    """Rows of the table of a part's points in a place."""
    numbers = np.concatenate([1 + np.arange(len(SURFACE[name][0])) for name in FEATURES])
    return [
        (place, name, number, *one)
        for name, number, one in zip(OF.tolist(), numbers.tolist(), x.tolist(), strict=True)
    ]


def expected(name: str) -> np.ndarray | float:
    """The form deviation of members that the file expects: a bow of A along x of 3 um."""
    if name != "flatness A":
        return 0.0
    x = SURFACE["A"][0]
    bow = (x[:, 0] - 0.1) ** 2
    rows = np.column_stack([np.ones(len(x)), x[:, :2]])
    bow = bow - rows @ np.linalg.lstsq(rows, bow, rcond=None)[0]
    return np.asarray(3e-6 * bow / np.ptp(bow))


def drawn_values(
    name: str, covariance: np.ndarray, start: Any, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Errors of values from members drawn about a start."""
    nominal = start + np.zeros((1, len(covariance)))
    drawn = nominal + rng.multivariate_normal(nominal[0] * 0, covariance, count, method="eigh")
    if name == "roundness pin hole":
        return zones(drawn)
    return values(name, drawn) - values(name, nominal)


def zones(residuals: np.ndarray) -> np.ndarray:
    """Minimum zones (b,) of small residuals (b, 6) about the pin hole: a linear minimax is that of
    the worst four points, each of which has equal residuals of signs that are orthogonal to all
    changes of the circle.
    """
    points = SURFACE["pin hole"][1]
    found = []
    for four in combinations(range(6), 4):
        rows = np.column_stack([np.ones(4), points[list(four), :2]])
        signs = np.linalg.svd(rows.T)[2][-1]
        found.append(2 * np.abs(residuals[:, four] @ signs) / np.abs(signs).sum())
    return np.max(found, axis=0)


def laid(plan: Campaign, places: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scale readings of all points in all places, their probes, and normals."""
    names = list(plan.design.probes.names)
    x, probes, normals = [], [], []
    for place, where in places.items():
        rotation, origin = placed(where)
        probes.append([names.index(one) for one in probes_of(place)])
        x.append(CENTRES @ rotation.T + origin - plan.design.probes.offsets[probes[-1]])
        normals.append(NORMALS @ rotation.T)
    return np.concatenate(x), np.concatenate(probes), np.concatenate(normals)


def outside(plan: Campaign, places: Any, kelvin: float = 0.1) -> np.ndarray:
    """Covariance of displacements along normals beside the map, by the probing of `part_text`."""
    _, probes, normals = laid(plan, places)
    same = probes[:, None] == probes
    strain = np.tile((POINTS * NORMALS).sum(axis=1), len(places)) * STRAIN * kelvin
    is_equal = same & (np.abs(normals[:, None] - normals).max(axis=2) < 1e-9)
    covariance = 0.4e-6**2 * np.eye(len(probes)) + np.outer(strain, strain)
    return np.asarray(covariance + same * 0.1e-6**2 / 4 + is_equal * 0.3e-6**2 / 3)


def by_map(at: Campaign, sigma: float, places: Any) -> np.ndarray:
    """Covariance of displacements along normals by the campaign."""
    x, probes, normals = laid(at, places)
    rows = dense.jacobian(
        lambda step: np.einsum("ni,ni->n", at.corrected(step, x, probes), normals), sum(at.sizes)
    )
    root = sigma * rows @ at.spread.root
    return np.asarray(root @ root.T)
