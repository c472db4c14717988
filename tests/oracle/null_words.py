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
DEGREES = {"linear": 1, "quadratic": 2, "cubic": 3}

# Parts below one hundredth of the largest are not printed; levers differ by a few times between
# what the program and what this file calls the effect of a parameter.
UNPRINTED = 0.03
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
    is_whole: bool


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
                functions[name] = meaning.rpartition(", ")[2], peak, unit
    is_whole = not re.search(r"and \d+ (errors )?more", words)
    assert end.startswith("changes") == (len(plates) + bool(positions) + bool(functions) == 1), text
    return Sentence(functions, plates, positions, is_whole)


class Directions:
    """The null space of a dense problem by what its parameters belong to."""

    def __init__(self, expected: Expected):
        problem = self.problem = expected.problem
        self.null = expected.spread.null
        balls, poses = 3 * len(problem.plate_balls), len(problem.free_poses)
        design = problem.design
        # In metres, by what each parameter moves a point at the most.
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
            if function.zero_at_one:
                start = len(self.owner) - function.free
                self.size[start : len(self.owner)] = 0.25
        assert balls + poses + len(problem.a) == len(self.owner)

    def allowed(self, sentence: Sentence) -> NDArray[np.bool_]:
        """Parameters (n,) that a sentence names."""
        degrees = {name: told[0] for name, told in sentence.functions.items()}
        zero_at_one = {f.name: int(f.zero_at_one) for f in self.problem.functions}
        found = []
        for kind, name, place in self.owner:
            if kind == "function":
                degree = DEGREES.get(degrees.get(name, ""), 0)
                found.append(name in degrees and place + 1 + zero_at_one[name] <= degree)
            elif kind == "position":
                found.append(name in sentence.positions)
            else:
                found.append(name in sentence.plates)
        return np.array(found)

    def moving_only(self, sentence: Sentence) -> tuple[Real, float]:
        """Null directions (n, k) that move nothing unnamed, and how far they move it, relative."""
        orthonormal = np.linalg.qr(self.null * self.size[:, None])[0]
        unnamed = orthonormal[~self.allowed(sentence)]
        if not len(unnamed):
            return orthonormal / self.size[:, None], 0.0
        _, values, rows = np.linalg.svd(unnamed, full_matrices=True)
        values = np.concatenate([values, np.zeros(len(rows) - len(values))])
        kept = values < 1e-7
        rest = 0.0
        if not kept.any():
            kept = values < UNPRINTED
            rest = float(values[kept].max(initial=0.0))
        return orthonormal @ rows[kept].T / self.size[:, None], rest

    def curve(self, direction: Real, name: str) -> Real:
        """Values of an error function along its axis, at 201 places."""
        chosen = [
            k for k, (kind, own, _) in enumerate(self.owner) if (kind, own) == ("function", name)
        ]
        function = next(one for one in self.problem.functions if one.name == name)
        t = np.linspace(0.0, 1.0, 201)
        powers = np.stack([t**k for k in range(1, function.coefficients)], axis=1)
        return np.asarray(powers @ dense.monomial_matrix(function) @ direction[chosen])

    def pose(self, direction: Real, name: str) -> Real:
        """Shift and rotation vector (6,) of a position."""
        values = np.zeros(6)
        for k, (kind, own, place) in enumerate(self.owner):
            if (kind, own) == ("position", name):
                values[place] = direction[k]
        return values

    def balls(self, direction: Real, name: str) -> tuple[Real, Real]:
        """Places and movements (n, 3) of a plate's balls."""
        chosen = [
            k for k, (kind, own, _) in enumerate(self.owner) if (kind, own) == ("plate", name)
        ]
        members = [self.owner[k][2] for k in chosen[::3]]
        return self.problem.balls[members], direction[chosen].reshape(-1, 3)


def peak(values: Real) -> float:
    """The largest value of a curve, with its sign."""
    return float(values[np.abs(values).argmax()])


def resolved(directions: Directions, sentence: Sentence) -> tuple[Real, float] | None:
    """The one direction with the printed amounts, and how far it moves what is not named; None
    where the words leave several.
    """
    basis, rest = directions.moving_only(sentence)
    assert basis.shape[1], "what is named cannot move without a change of observations"
    if not sentence.functions:
        return None
    name, (_, told, unit) = next(iter(sentence.functions.items()))
    wanted = float(told) * FACTORS[unit]
    if basis.shape[1] == 1:
        direction = basis[:, 0]
        return direction * wanted / peak(directions.curve(direction, name)), rest
    # Amounts of straight lines, at the end of their axes, fix what the names leave open.
    rows, amounts = [], []
    for name, (shape, told, unit) in sentence.functions.items():
        if shape == "linear":
            rows.append([directions.curve(one, name)[-1] for one in basis.T])
            amounts.append(float(told) * FACTORS[unit])
    if not rows or np.linalg.matrix_rank(np.array(rows), 1e-6) < basis.shape[1]:
        return None
    return basis @ np.linalg.lstsq(np.array(rows), np.array(amounts), rcond=None)[0], rest


def judge(directions: Directions, sentence: Sentence, direction: Real, rest: float) -> None:
    """Every amount, axis and shape of a sentence, for the direction that it describes."""
    largest = float(np.abs(direction * directions.size).max())

    def same(told: str, value: float, unit: str) -> None:
        # What is printed starts from an amount of three digits, and leaves out what hardly moves.
        value /= FACTORS[unit]
        step = step_of(value, DIGITS) + 0.004 * abs(value)
        slack = 3.0 * rest * largest / FACTORS[unit]
        assert within(told, value, step + 2.0 * slack), (sentence, told, value)

    for name, (shape, told, unit) in sentence.functions.items():
        values = directions.curve(direction, name)
        assert unit == ("µrad" if name[1] in "ABC" else "µm")
        same(told, peak(values), unit)
        t = np.linspace(0.0, 1.0, 201)
        left = values - np.polyval(np.polyfit(t, values, max(DEGREES[shape] - 1, 0)), t)
        assert np.abs(left).max() > 1e-4 * np.abs(values).max(), (name, shape)
    for name, told in sentence.positions.items():
        pose = directions.pose(direction, name)
        amounts = re.findall(rf"({NUMBER}) (µm|µrad)(?: (along|about) ([xyz]))?", told)
        units = [unit for _, unit, _, _ in amounts]
        for part, unit in ((pose[:3], "µm"), (pose[3:], "µrad")):
            size = float(np.linalg.norm(part))
            if unit not in units:
                assert size < 1e-3 * largest + rest * largest, (name, told, part)
        assert amounts, (name, told)
        for figure, unit, word, axis in amounts:
            part = pose[:3] if unit == "µm" else pose[3:]
            same(figure, float(np.linalg.norm(part)), unit)
            if word:
                assert word == ("along" if unit == "µm" else "about")
                along = abs(part[AXES.index(axis)]) / np.linalg.norm(part)
                assert along > 0.998 - rest, (name, told, part)
            elif rest == 0.0:
                assert np.abs(part).max() < 0.9995 * np.linalg.norm(part), (name, told, part)
    for name, (words, figure, unit) in sentence.plates.items():
        places, moved = directions.balls(direction, name)
        same(figure, float(np.linalg.norm(moved, axis=1).max()), unit)
        if rest == 0.0:
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
