"""Motion of machine and plates along directions that observations do not show, or show too weakly:
what a picture of them moves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design.arrays import locations, nominal_state
from ballplate.simulator.estimation.corrections import correction_rows
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.geometry.motions import without_rigid_motion
from ballplate.simulator.inputs.quantities import Target
from ballplate.simulator.machines.protocol import Array, Integers

from .verdict import Verdict, independent_mixture, weak_roots

# Nodes of the lattice along each axis: edges of it that bend are drawn as curves.
NODES = 9


@dataclass(frozen=True, eq=False)
class Motion:
    """How a direction moves the corrected places of a lattice through the volume, and of the balls
    as they are read.

    `nodes` (n, d) and `readings` (m, d) are displacements in metres, relative to one another: their
    common rigid motion is taken out. `words` say what changes, and `is_weak` that observations show
    it, too weakly.
    """

    words: str
    is_weak: bool
    nodes: Array
    readings: Array

    @property
    def largest(self) -> float:
        """The largest displacement, in metres."""
        return float(np.linalg.norm(np.concatenate([self.nodes, self.readings]), axis=1).max())


def lattice(lower: Array, upper: Array, nodes: int = NODES) -> Array:
    """Nodes (nodes**d, d) of a lattice through a volume, x running slowest.

    >>> lattice(np.zeros(2), np.ones(2), 2).tolist()
    [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]
    """
    sides = [np.linspace(low, high, nodes) for low, high in zip(lower, upper, strict=True)]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(sides))


def motions(at: Linearisation, judged: Verdict, target: Target | None = None) -> tuple[Motion, ...]:
    """The motion of each undetermined and of each weak direction that a verdict tells, in its
    order; readings are those of the design.

    The balls of a plate move as the corrected readings of them do, wherever these are the same to
    all observations.
    """
    design, layout = at.design, at.layout
    weak = weak_roots(at, target)[0]
    directions = np.concatenate([at.shared_null @ independent_mixture(at), weak], axis=1)
    if not directions.shape[1]:
        return ()
    read = design.readings
    nodes = lattice(design.machine.volume.lower, design.machine.volume.upper)
    balls = locations(design, nominal_state(design), read) - design.probes.offsets[read.probe]
    of_nodes = np.full(len(nodes), design.evaluation.probe)
    points = np.concatenate([nodes, balls])
    probes: Integers = np.concatenate([of_nodes, read.probe])
    rows = correction_rows(design, layout, nominal_state(design), points, probes)
    moved = without_rigid_motion(points + design.probes.offsets[probes], rows @ directions)
    told = (*judged.null, *judged.weak)
    return tuple(
        Motion(
            str(one), k >= len(judged.null), moved[: len(nodes), :, k], moved[len(nodes) :, :, k]
        )
        for k, one in enumerate(told)
    )
