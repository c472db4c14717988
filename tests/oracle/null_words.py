"""Sentences on undetermined directions, taken at their word.

The errors, balls and positions that a sentence names are moved by the printed amounts, all others
stay, and no observation may change: among the changes of parameters that the dense Jacobian of all
residuals maps to zero, there has to be one with the printed amounts that moves nothing unnamed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.oracle.campaigns import AXES, Expected
from tests.oracle.printed import FACTORS, NUMBER, step_of, within
from tests.reference import dense

Real = NDArray[np.float64]
POSE_AMOUNT = re.compile(rf"({NUMBER}) (µm|µrad)(?: (along|about) ([xyz]))?")
DEGREES = {"linear": 1, "quadratic": 2, "cubic": 3}

# Three digits are printed.
DIGITS = 3


@dataclass(frozen=True)
class Sentence:
    """What a line on an undetermined direction names: error functions with degree, peak and unit,
    plates with words and the largest movement of a ball, positions with their amounts.
    """

    functions: dict[str, tuple[str, str, str]]
    plates: dict[str, tuple[str, str, str]]
    positions: dict[str, str]
    more_functions: bool
    more_positions: bool

    @property
    def is_whole(self) -> bool:
        return not (self.more_functions or self.more_positions)


def sentences(text: str) -> tuple[list[Sentence], int]:
    """All sentences of a verdict, and how many directions it counts without naming them."""
    found = [
        _sentence(line.partition(": ")[2])
        for line in text.splitlines()
        if re.match(r"undetermined \d+: ", line)
    ]
    more = re.search(r"^undetermined: (\d+) directions more$", text, re.M)
    return found, int(more[1]) if more is not None else 0


def _sentence(text: str) -> Sentence:
    words, _, end = text.rpartition(": ")
    assert end in ("change together without changing any observation", "changes no observation")
    functions, plates, positions = {}, {}, {}
    parts = words.split("; ")
    for part in parts:
        if part.startswith("moved positions: "):
            told = part.removeprefix("moved positions: ")
            positions = dict(re.findall(r"(?:^|, )([^(),]+) \(([^)]*)\)", told))
        elif " (balls by up to " in part:
            match = re.fullmatch(rf"(\w+) (.*) \(balls by up to ({NUMBER}) (\S+)\)", part)
            assert match is not None, part
            plates[match[1]] = match[2], match[3], match[4]
        else:
            every = re.findall(rf"(E\w\w) \(([^()]*)\) by ({NUMBER}) (µm|µrad)", part)
            assert every, part
            for name, meaning, peak, unit in every:
                # A straightness in proportion to its axis is a squareness.
                is_slope = len(name) == 3 and meaning.startswith("squareness")
                shape = "linear" if is_slope else meaning.rpartition(", ")[2]
                functions[name] = shape, peak, unit
    more = [bool(re.search(rf"and \d+ {word}more", words)) for word in ("errors ", "")]
    assert end.startswith("changes") == (len(plates) + bool(positions) + bool(functions) == 1), text
    return Sentence(functions, plates, positions, *more)


class Directions:
    """The null space of a dense problem by what its parameters belong to."""

    def __init__(self, expected: Expected):
        problem = self.problem = expected.problem
        self.null = expected.spread.null
        volume = problem.design.machine.volume
        self.span = float((volume.upper - volume.lower).max())
        balls, poses = 3 * len(problem.plate_balls), len(problem.free_poses)
        design = problem.design
        # In metres, by what each parameter of a plate or position moves a point at the most.
        self.size = np.ones(problem.parameters)
        self.owner: list[tuple[str, str, int]] = []
        for b in problem.plate_balls:
            plate = design.artefacts.names[design.balls.artefact[b]]
            self.owner += [("plate", plate, b)] * 3
        for k, j in problem.free_poses:
            self.owner.append(("position", design.positions.names[k], j))
            own = design.balls.places[design.balls.artefact == design.positions.artefact[k]]
            self.size[len(self.owner) - 1] = np.ptp(own, axis=0).max() if j >= 3 else 1.0
        for function in problem.functions:
            self.owner += [("function", function.name, power) for power in range(function.free)]
        assert balls + poses + len(problem.a) == len(self.owner)

    def allowed(self, sentence: Sentence) -> NDArray[np.bool_]:
        """Parameters (n,) that a sentence names."""
        degrees = {name: told[0] for name, told in sentence.functions.items()}
        zero_at_one = {f.name: int(f.zero_at_one) for f in self.problem.functions}
        found = []
        for kind, name, place in self.owner:
            if kind == "function":
                degree = DEGREES.get(degrees.get(name, ""), 0)
                is_named = name in degrees and place + 1 + zero_at_one[name] <= degree
                found.append(is_named or (sentence.more_functions and name not in degrees))
            elif kind == "position":
                found.append(name in sentence.positions or sentence.more_positions)
            else:
                found.append(name in sentence.plates)
        return np.array(found)

    def moving_only(self, sentence: Sentence) -> Real:
        """Null directions (n, k) that move nothing unnamed."""
        orthonormal = np.linalg.qr(self.null * self.size[:, None])[0]
        unnamed = orthonormal[~self.allowed(sentence)]
        _, values, rows = np.linalg.svd(unnamed, full_matrices=True)
        values = np.concatenate([values, np.zeros(len(rows) - len(values))])
        return np.asarray(orthonormal @ rows[values < 1e-7].T / self.size[:, None])

    def moves_all(self, sentence: Sentence, basis: Real) -> bool:
        """Whether directions (n, k) move all that a sentence names."""
        named = {"function": sentence.functions, "plate": sentence.plates}
        named["position"] = sentence.positions
        moved = (np.abs(basis) * self.size[:, None]).max(axis=1, initial=0.0) > 1e-7
        moving = {
            (kind, name) for (kind, name, _), one in zip(self.owner, moved, strict=True) if one
        }
        return all((kind, name) in moving for kind, names in named.items() for name in names)

    @staticmethod
    def powers(function: dense.Function, t: Real) -> Real:
        """Values (t, free) of an error function for each of its coefficients."""
        powers = np.stack([t**k for k in range(1, function.coefficients)], axis=1)
        return np.asarray(powers @ dense.monomial_matrix(function))

    def curve(self, direction: Real, name: str) -> Real:
        """Values (201, ...) of an error function along its axis."""
        chosen = [
            k for k, (kind, own, _) in enumerate(self.owner) if (kind, own) == ("function", name)
        ]
        function = next(one for one in self.problem.functions if one.name == name)
        return np.asarray(self.powers(function, np.linspace(0.0, 1.0, 201)) @ direction[chosen])

    def pose(self, direction: Real, name: str) -> Real:
        """Shift and rotation vector (6, ...) of a position."""
        values = np.zeros((6, *direction.shape[1:]))
        for k, (kind, own, place) in enumerate(self.owner):
            if (kind, own) == ("position", name):
                values[place] = direction[k]
        return values

    def balls(self, direction: Real, name: str) -> tuple[Real, Real]:
        """Places (n, 3) and movements (3 n, ...) of a plate's balls."""
        chosen = [
            k for k, (kind, own, _) in enumerate(self.owner) if (kind, own) == ("plate", name)
        ]
        members = [self.owner[k][2] for k in chosen[::3]]
        return self.problem.balls[members], direction[chosen]


@dataclass(frozen=True)
class Described:
    """The direction (n,) of a sentence, and what half of the last digit of each amount that it
    comes from changes of it (n, amounts).
    """

    direction: Real
    doubts: Real


def resolved(directions: Directions, sentence: Sentence) -> Described | None:
    """The one direction that moves nothing unnamed and has the printed amounts of errors; None
    where there is none or several.
    """
    basis = directions.moving_only(sentence)
    count = basis.shape[1]
    if not count or not directions.moves_all(sentence, basis):
        return None
    curves = {name: directions.curve(basis, name) for name in sentence.functions}
    # Straight lines are largest at their ends; where others are follows from these.
    at = {name: -1 for name, (shape, _, _) in sentence.functions.items() if shape == "linear"}
    if count == 1:
        at = {name: int(np.abs(curve[:, 0]).argmax()) for name, curve in curves.items()}
    for _ in range(10):
        rows = np.array([curves[name][place] for name, place in at.items()])
        if not at or np.linalg.matrix_rank(rows, 1e-6) < count:
            return None
        amounts, halves = np.array([amount_of(*sentence.functions[name][1:]) for name in at]).T
        inverse = np.linalg.pinv(rows / halves[:, None])
        mixture = inverse @ (amounts / halves)
        at = {name: int(np.abs(curve @ mixture).argmax()) for name, curve in curves.items()}
    if (np.abs(rows @ mixture - amounts) > 1.2 * halves).any():
        # What is described has parts, too, that are not printed.
        return None
    return Described(basis @ mixture, basis @ inverse)


def amount_of(figure: str, unit: str) -> tuple[float, float]:
    """A printed amount and half of its last digit, in metres or radians.

    >>> amount_of("-250", "µm")
    (-0.00025, 5e-07)
    """
    value = float(figure)
    return value * FACTORS[unit], 0.5 * step_of(value, DIGITS) * FACTORS[unit]


def judge(directions: Directions, sentence: Sentence, described: Described) -> None:
    """Every amount, axis and shape of a sentence, for the direction that it describes."""
    direction, doubts = described.direction, described.doubts
    largest = float(np.abs(direction * directions.size).max())

    def same(told: str, value: float, doubt: float, unit: str) -> None:
        # `doubt` is what the digits leave open from which the value is computed.
        value, doubt = value / FACTORS[unit], doubt / FACTORS[unit]
        step = step_of(value, DIGITS) + doubt / 0.6
        assert within(told, value, step), (sentence, told, value, doubt)

    for name, (shape, told, unit) in sentence.functions.items():
        values = directions.curve(direction, name)
        assert unit == ("µrad" if name[1] in "ABC" else "µm")
        place = int(np.abs(values).argmax())
        doubt = sum(abs(directions.curve(one, name)[place]) for one in doubts.T)
        same(told, float(values[place]), doubt, unit)
        t = np.linspace(0.0, 1.0, 201)
        left = values - np.polyval(np.polyfit(t, values, max(DEGREES[shape] - 1, 0)), t)
        assert np.abs(left).max() > 1e-4 * np.abs(values).max(), (name, shape)
    for name, told in sentence.positions.items():
        pose = directions.pose(direction, name)
        of_doubts = np.array([directions.pose(one, name) for one in doubts.T])
        amounts = POSE_AMOUNT.findall(told)
        units = [unit for _, unit, _, _ in amounts]
        parts = {"µm": slice(0, 3), "µrad": slice(3, 6)}
        doubt_of = {
            unit: float(np.linalg.norm(of_doubts[:, part], axis=1).sum())
            for unit, part in parts.items()
        }
        for unit, part in parts.items():
            size = float(np.linalg.norm(pose[part]))
            if unit not in units:
                least = 1e-3 * largest + doubt_of[unit]
                assert size < least, (name, told, pose[part])
        assert amounts, (name, told)
        for figure, unit, word, axis in amounts:
            part = pose[parts[unit]]
            size, doubt = float(np.linalg.norm(part)), doubt_of[unit]
            same(figure, size, doubt, unit)
            # A doubt turns a vector of a size by this at the most.
            turned = doubt / size
            if word:
                assert word == ("along" if unit == "µm" else "about")
                along = abs(part[AXES.index(axis)]) / size
                assert along > 0.998 - turned, (name, told, part)
            elif turned < 0.01:
                assert np.abs(part).max() < 0.9995 * size, (name, told, part)
    for name, (words, figure, unit) in sentence.plates.items():
        places, moved = directions.balls(direction, name)
        moved = moved.reshape(-1, 3)
        of_balls = [
            np.linalg.norm(directions.balls(one, name)[1].reshape(-1, 3), axis=1)
            for one in doubts.T
        ]
        sizes = np.linalg.norm(moved, axis=1)
        doubt = float(np.sum(of_balls, axis=0).max())
        same(figure, float(sizes.max()), doubt, unit)
        if doubt < 1e-2 * sizes.max():
            _judge_deformation(words, places, moved)


def _judge_deformation(words: str, places: Real, moved: Real) -> None:
    """Stretches, shears and bends by a fit of a rigid motion, a strain and what is left."""
    centred = places - places.mean(axis=0)
    n = len(places)
    rigid = np.zeros((3 * n, 6))
    for axis in range(3):
        rigid[axis::3, axis] = 1.0
        rigid[:, 3 + axis] = np.cross(np.eye(3)[axis], centred).ravel()
    strains = {}
    for i, j in ((0, 0), (1, 1), (0, 1)):
        form = np.zeros((n, 3))
        form[:, i] += centred[:, j]
        form[:, j] += centred[:, i] * (i != j)
        strains[AXES[i] + AXES[j]] = form.ravel()
    whole = np.column_stack([rigid, *strains.values()])
    flat = moved.ravel()
    of_rigid = flat - rigid @ np.linalg.lstsq(rigid, flat, rcond=1e-9)[0]
    is_rigid = np.linalg.norm(of_rigid) < 1e-5 * np.linalg.norm(flat)
    assert is_rigid == (words == "moves as a whole"), words
    if is_rigid:
        return
    found = np.linalg.lstsq(whole, flat, rcond=1e-9)[0]
    strain = dict(zip(strains, found[6:].tolist(), strict=True))
    size = max(abs(one) for one in strain.values())
    for axis in "xy":
        share = abs(strain[axis * 2]) / size
        named = re.search(rf"(stretches|shrinks|and) (along )?its {axis}\b|as a whole", words)
        if re.search("stretches|size|shears", words):
            assert share > 0.02 if named else share < 0.2, (words, strain)
    if stretched := re.search(r"stretches along its (\w)(?: and its (\w))?", words):
        first, second = stretched[1], stretched[2]
        if second:
            assert strain[first * 2] * strain[second * 2] > 0, (words, strain)
    if "shrinks" in words:
        assert strain["xx"] * strain["yy"] < 0, (words, strain)
    if "shears" in words:
        assert "its xy plane" in words and abs(strain["xy"]) > 0.02 * size, (words, strain)
    left = (flat - whole @ found).reshape(-1, 3)
    if "bends out of its plane" in words:
        assert (left[:, 2] ** 2).sum() > 0.45 * (left**2).sum() > 0, words
    elif "distorts" in words:
        assert (left**2).sum() > 0 and (left[:, 2] ** 2).sum() < 0.55 * (left**2).sum(), words
    else:
        assert (left**2).sum() < 0.03 * (of_rigid**2).sum(), words
