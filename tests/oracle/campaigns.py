"""Experiments drawn at random, and the dense reference of what they and their readings tell."""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from numpy.typing import NDArray

from tests.reference import dense
from tests.reference.random_experiments import PROBES, random_text

Real = NDArray[np.float64]
AXES = "xyz"


@dataclass(frozen=True)
class Expected:
    """What follows from a problem: the covariance of its parameters times `sigma` squared."""

    problem: dense.Problem
    sigma: float = 1.0

    @cached_property
    def rows(self) -> Real:
        problem = self.problem
        return dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)

    @cached_property
    def spread(self) -> dense.Spread:
        return dense.spread(self.rows)

    def linear(self, function: Any) -> Real:
        return dense.jacobian(function, self.problem.parameters)

    def uncertainties(self, function: Any) -> Real:
        return self.sigma * self.spread.of(self.linear(function))

    @cached_property
    def quantities(self) -> dict[str, Real]:
        return {symbol: self.uncertainties(function) for symbol, function in self.functions.items()}

    @property
    def functions(self) -> dict[str, Any]:
        """What U1 to U6 are of; U3 without error functions that have no free coefficient."""
        found = dense.quantities(self.problem)
        kept = [
            function.free > 0
            for function in self.problem.functions
            for _ in range(1, function.coefficients)
        ]
        return found | {"U3": lambda step: found["U3"](step)[kept]}

    @cached_property
    def names(self) -> dict[str, list[str]]:
        """What each figure behind U1 to U6 is of, in their order."""
        problem, design = self.problem, self.problem.design
        words = [f"{what} {axis}" for what in ("origin", "rotation") for axis in AXES]
        points = range(1, len(design.evaluation.points) + 1)
        plates = [
            [b for b in problem.plate_balls if design.balls.artefact[b] == plate]
            for plate in np.flatnonzero(design.artefacts.is_plate)
        ]

        def pairs(names: list[str]) -> list[str]:
            first, second = dense.pairs_of(len(names))
            return [f"{names[i]} to {names[j]}" for i, j in zip(first, second, strict=True)]

        plural = len(design.artefacts.names) > 1
        balls = [
            f"ball {design.artefacts.names[owner]}/{name}" if plural else f"ball {name}"
            for owner, name in zip(design.balls.artefact, design.balls.names, strict=True)
        ]
        determined = replace(problem, functions=[f for f in problem.functions if f.free])
        return {
            "U1": [f"{balls[b]} {axis}" for b in problem.plate_balls for axis in AXES],
            "U2": [f"{design.positions.names[k]}: {words[j]}" for k, j in problem.free_poses],
            "U3": dense.monomial_names(determined),
            "U4": [f"point {k} {axis}" for k in points for axis in AXES],
            "U5": [name for own in plates for name in pairs([balls[b] for b in own])],
            "U6": pairs([f"point {k}" for k in points]),
        }

    @cached_property
    def split(self) -> dict[str, tuple[Real, list[str], str]]:
        """Figures, names and unit of each line of a table of uncertainties."""
        found = {}
        for symbol, values in self.quantities.items():
            names = self.names[symbol]
            if symbol in ("U2", "U3"):
                mark = ": rotation" if symbol == "U2" else r"EA EB EC"
                turns = np.array(
                    [mark in name if symbol == "U2" else name[:2] in mark for name in names], bool
                )
                for word, unit, chosen in (("lengths", "m", ~turns), ("angles", "rad", turns)):
                    which = np.flatnonzero(chosen)
                    if len(which):
                        found[f"{symbol} {word}"] = values[which], [names[i] for i in which], unit
            elif len(values):
                found[symbol] = values, names, "m"
        return found

    def displacements(self, points: Real, offset: Real) -> Any:
        """Corrected points (m, 3), as a function of a step."""
        problem = self.problem
        offsets = np.broadcast_to(offset, points.shape)
        return lambda step: dense.corrected(
            problem, points, dense.unpack(problem, step)[3], np.array(offsets)
        )

    def corrected(self, points: Real, offset: Real) -> tuple[Real, Real]:
        """Corrected points (m, 3), and a root of their covariance (3 m, rank)."""
        function = self.displacements(points, offset)
        value = function(np.zeros(self.problem.parameters))
        linear = self.linear(lambda step: function(step).ravel())
        return value, self.sigma * linear @ self.spread.root


def planned(path: Path) -> Expected:
    """What an experiment file of the usual arrangement promises."""
    told = yaml.safe_load(path.read_text(encoding="utf-8"))["error_model"]
    design = lay_out(load(path)[0])
    counts = told["position_coefficients"], told["rotation_coefficients"]
    return Expected(dense.planned(design, *counts))


@dataclass(frozen=True)
class Fitted(Expected):
    """What readings give: `nominal` is the problem as planned."""

    nominal: dense.Problem | None = None
    sum_of_squares: float = 0.0
    degrees_of_freedom: int = 0

    @cached_property
    def estimates(self) -> dict[str, float]:
        """Every estimate by the name that `fit --monomials` gives it."""
        problem, design = self.problem, self.problem.design
        assert self.nominal is not None
        found, start = {}, 0
        for function in problem.functions:
            values = dense.monomial_matrix(function) @ problem.a[start : start + function.free]
            found |= {f"{function.name} t^{k + 1}": value for k, value in enumerate(values)}
            start += function.free
        for name, (k, j) in zip(self.names["U2"], problem.free_poses, strict=True):
            turn = problem.rotations[k] @ self.nominal.rotations[k].T
            about = 0.5 * np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
            about -= 0.5 * np.array([turn[1, 2], turn[2, 0], turn[0, 1]])
            found[name] = problem.origins[k, j] if j < 3 else about[j - 3]
        for b in problem.plate_balls:
            name = design.balls.names[b]
            found |= {f"{name}: {axis}": problem.balls[b, i] for i, axis in enumerate(AXES)}
        return {name: float(value) for name, value in found.items()}

    @cached_property
    def standard_uncertainties(self) -> dict[str, float]:
        names = self.names["U3"] + self.names["U2"]
        names += [name.removeprefix("ball ")[:-2] + ": " + name[-1] for name in self.names["U1"]]
        values = [self.quantities[symbol] for symbol in ("U3", "U2", "U1")]
        return dict(zip(names, np.concatenate(values).tolist(), strict=True))

    @cached_property
    def coefficient_root(self) -> Real:
        """A root of the covariance of the coefficients behind U3."""
        return np.asarray(self.sigma * self.linear(self.functions["U3"]) @ self.spread.root)

    def curve(self, name: str, t: Real) -> tuple[Real, Real]:
        """Values of an error function at places (m,) of its axis, with standard uncertainties."""
        names = [one for one in self.names["U3"] if one.startswith(f"{name} t^")]
        powers = np.stack([t ** int(one[-1]) for one in names], axis=1)
        root = self.coefficient_root[[self.names["U3"].index(one) for one in names]]
        u = np.linalg.norm(powers @ root, axis=1)
        return powers @ np.array([self.estimates[one] for one in names]), u


def fitted(path: Path, readings: Path) -> Fitted:
    """The least squares of a file of readings in millimetres, sigma estimated."""
    nominal = planned(path).problem
    design = nominal.design
    by_key = {}
    with readings.open(encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            key = row["position"], row["ball"], row["probe"]
            by_key[key] = [1e-3 * float(row[f"{axis}_mm"]) for axis in AXES]
    own = design.readings
    names = (
        [design.positions.names[k] for k in own.position],
        [design.balls.names[b] for b in own.ball],
        [design.probes.names[p] for p in own.probe],
    )
    scales = np.array([by_key[key] for key in zip(*names, strict=True)])
    problem = replace(nominal, scales=scales)
    for _ in range(4):
        step, _ = dense.least_squares_step(problem)
        balls, rotations, origins, a = dense.unpack(problem, step)
        problem = replace(problem, balls=balls, rotations=rotations, origins=origins, a=a)
    left = dense.residuals(problem, np.zeros(problem.parameters))
    freedom = len(left) - problem.parameters
    total = float(left @ left)
    return Fitted(problem, float(np.sqrt(total / freedom)), nominal, total, freedom)


def random_file(seed: int, folder: Path) -> Path:
    """An experiment drawn without knowing what is needed, as the dense reference can compute it."""
    told = yaml.safe_load(random_text(seed))
    draw = np.random.default_rng(1000 + seed)
    counts = draw.integers(2, 5, 2).tolist()
    told["error_model"] = {
        "kind": "kinematic",
        "arrangement": "MB2",
        "position_coefficients": counts[0],
        "rotation_coefficients": counts[1],
    }
    told["evaluation"]["points"]["random"] = 8
    known = told.setdefault("calibration", [])
    if "bar" in told["artefacts"] and not any(one["artefact"] == "bar" for one in known):
        length = {"artefact": "bar", "kind": "distances", "pairs": "all"}
        known.append(length | {"standard_uncertainty": "0.3 um"})
    if not known:
        del told["calibration"]
    path = folder / f"drawn{seed}.yaml"
    path.write_text(yaml.safe_dump(told, sort_keys=False), encoding="utf-8")
    return path


def campaign_file(seed: int, folder: Path, **changed: Any) -> Path:
    """An experiment that determines everything: a plate in six positions somewhere in a volume."""
    draw = np.random.default_rng(seed)
    rows, columns = (3, 2) if draw.random() < 0.5 else (3, 3)
    size = [f"{value} mm" for value in draw.integers(500, 650, 2)]
    ends = [(int(low), int(low) + int(extent)) for low, extent in draw.integers(900, 1300, (3, 2))]
    volume = {axis: [f"{one} mm" for one in end] for axis, end in zip(AXES, ends, strict=True)}
    positions = []
    for k, axis in enumerate("zzxxyy"):
        low = dict(zip(AXES, (end[0] for end in ends), strict=True))
        others = [other for other in AXES if other != axis]
        positions.append(
            {
                "name": f"{axis}{k}",
                "plane": axis,
                "level": f"{low[axis] + int(draw.integers(150, 350)) + 400 * (k % 2)} mm",
                "corner": {o: f"{low[o] + int(draw.integers(0, 200))} mm" for o in others},
                "quarter_turns": k % 2,
                "probes": {"x": ["right", "left"], "y": ["back", "front"], "z": ["down"]}[axis],
            }
        )
    told = {
        "title": f"campaign {seed}",
        "machine": {
            "volume": volume,
            "repeatability": [f"{value:.3f} um" for value in draw.uniform(0.1, 0.6, 3)],
        },
        "error_model": {
            "kind": "kinematic",
            "arrangement": "MB2",
            "position_coefficients": int(draw.integers(3, 5)),
            "rotation_coefficients": 3,
        },
        "true_machine": {"kind": "random", "position": "2 um", "rotation": "4 urad", "seed": seed},
        "probes": PROBES,
        "artefacts": {"plate": {"kind": "grid", "balls": [rows, columns], "size": size}},
        "positions": positions,
        "calibration": [
            {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.3 um"},
            {"kind": "coordinates", "balls": ["r1c1", "r2c2"], "standard_uncertainty": "0.5 um"},
        ],
        "evaluation": {"points": {"random": 10, "seed": seed}, "probe": "right"},
        "target_uncertainty": "0.3 um + L/1000000",
        "seed": seed,
    }
    path = folder / f"campaign{seed}.yaml"
    path.write_text(yaml.safe_dump(told | changed, sort_keys=False), encoding="utf-8")
    return path
