"""Prior knowledge of shared parameters: poses, probe offsets, machine errors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from ballplate.simulator.geometry.motions import vector_from_rotation, vector_rate
from ballplate.simulator.inputs.number_arrays import Array, Flags, Integers
from ballplate.simulator.machines.protocol import ErrorModel, Unit

from ..arrays import Design, Observations, Rows, Words
from ..parameters import shared_layout
from ..state import State


@dataclass(frozen=True)
class Priors(Observations):
    """Prior knowledge of shared parameters; arrays (m,), metres, radians or ratios.

    Each row is about a pose parameter (`position` and `component`, index in origin and rotation),
    about a probe offset (`probe` and `component`), about a parameter of an influence quantity
    (`influence`), or about a linear function of the model's parameters, `by_model` (m, n), and of
    probe offsets, `by_offset` (m, l, d); indices that do not apply are -1, absent arrays None.
    `units` are those of the rows, if stated. Origins and offsets are stated as co-ordinates, pose
    angles as deviations from the nominal pose.
    """

    word: ClassVar[str] = "prior"
    words: ClassVar[Words] = Words("stated", cure="check it in the experiment file")

    names: tuple[str, ...]
    position: Integers
    probe: Integers
    component: Integers
    by_model: Array
    value: Array
    uncertainty: Array
    influence: Integers | None = None
    by_offset: Array | None = None
    units: tuple[Unit, ...] = ()

    @property
    def of_influence(self) -> Integers:
        """The parameter of influence quantities (m,) that each is about, -1 without one."""
        return np.full(len(self), -1) if self.influence is None else self.influence

    @property
    def of_model(self) -> Flags:
        """Mask (m,) of priors on the error model."""
        return (self.position < 0) & (self.probe < 0) & (self.of_influence < 0)

    def select(self, chosen: Integers | Flags) -> Priors:
        """Return a selection."""
        rows = np.arange(len(self))[chosen]
        arrays = {
            name: array[rows] for name, array in vars(self).items() if isinstance(array, np.ndarray)
        }
        names = tuple(self.names[k] for k in rows)
        units = tuple(self.units[k] for k in rows if k < len(self.units))
        return replace(self, names=names, units=units, **arrays)

    def rows(self, design: Design, state: State, x: Array | None) -> Rows:
        weight = 1.0 / self.uncertainty
        return Rows(
            weight * (self._values(design, state) - self.value),
            weight[:, None] * self._derivative(design, state),
            np.zeros((len(self), 0, design.dimension)),
        )

    def true_values(self, design: Design, truth: State, model: ErrorModel) -> Array:
        """Return true values; those on an error model other than the true machine's are
        unchanged.
        """
        if model == design.model:
            return self._values(design, truth)
        # Parameters of one model have no values on another. Their priors are then taken as right.
        elsewhere = replace(truth, a=np.zeros(self.by_model.shape[1]))
        return np.where(self.of_model, self.value, self._values(design, elsewhere))

    def weights(self, design: Design, state: State) -> Array:
        """Largest derivatives (m,) by a parameter, in its effect."""
        derivative = self.rows(design, state, None).by_shared
        assert derivative is not None
        sizes = np.abs(derivative * design.once(shared_layout).scale).max(axis=1, initial=0.0)
        return np.asarray(sizes)

    def alike(self, design: Design, state: State) -> Priors:
        weights = self.weights(design, state)
        return replace(self, uncertainty=self.uncertainty * np.where(weights > 0.0, weights, 1.0))

    def name(self, design: Design, k: int) -> str:
        return f"prior of {self.names[k]}"

    def unit(self, design: Design, k: int) -> Unit:
        if k < len(self.units):
            return self.units[k]
        if self.position[k] >= 0:
            return "rad" if self.component[k] >= design.dimension else "m"
        if self.probe[k] >= 0:
            return "m"
        if self.of_influence[k] >= 0:
            return design.influence_parameters[self.of_influence[k]].unit
        used = np.flatnonzero(self.by_model[k])
        return design.model.parameters[int(used[0])].unit if len(used) else "1"

    def _values(self, design: Design, state: State) -> Array:
        """Return values (m,) at `state` of the functions that the priors concern."""
        # Every row looks up a value of each kind. Where its index is -1 the value is an arbitrary
        # one, and the selections below drop it.
        of_poses = _pose_values(design, state)[self.position, self.component]
        axis = np.minimum(self.component, design.dimension - 1)
        of_probes = state.probes[self.probe, axis]
        of_model = self.by_model @ state.a if len(self) else np.zeros(0)
        of_model = of_model + self.of_offsets(state.probes)
        if self.influence is not None and len(state.influences):
            of_model = np.where(self.influence >= 0, state.influences[self.influence], of_model)
        return np.where(
            self.position >= 0, of_poses, np.where(self.probe >= 0, of_probes, of_model)
        )

    def of_offsets(self, offsets: Array) -> Array:
        """Return the contribution of probe offsets (l, d) to each function (m,), without the
        model's.
        """
        if self.by_offset is None:
            return np.zeros(len(self))
        return np.einsum("mld,ld->m", self.by_offset, offsets)

    def _derivative(self, design: Design, state: State) -> Array:
        """Derivative (m, s) of the values by the shared parameters."""
        layout, d = design.once(shared_layout), design.dimension
        derivative = np.zeros((len(self), len(layout)))
        if not len(self):
            return derivative
        derivative[:, layout.model] = self.by_model
        if self.by_offset is not None:
            free = layout.offset_columns >= 0
            derivative[:, layout.offset_columns[free]] = self.by_offset[:, free]
        rows = np.flatnonzero(self.probe >= 0)
        derivative[rows, layout.offset_columns[self.probe[rows], self.component[rows]]] = 1.0
        rows = np.flatnonzero(self.of_influence >= 0)
        derivative[rows, layout.influences.start + self.of_influence[rows]] = 1.0
        rows = np.flatnonzero((self.position >= 0) & (self.component < d))
        derivative[rows, layout.pose_columns[self.position[rows], self.component[rows]]] = 1.0
        rows = np.flatnonzero((self.position >= 0) & (self.component >= d))
        place = self.position[rows]
        # The prior is on the rotation vector from the nominal pose, a parameter is a small turn
        # about the machine's axes at the state. For large deviations the two differ.
        rate = vector_rate(_pose_values(design, state)[place, d:])[
            np.arange(len(rows)), self.component[rows] - d
        ]
        columns = layout.pose_columns[place, d:]
        # What is held does not move.
        row, turn = np.nonzero(columns >= 0)
        derivative[rows[row], columns[row, turn]] = rate[row, turn]
        return derivative


def _pose_values(design: Design, state: State) -> Array:
    """Origins and rotations against the nominal pose (k, pose size)."""
    turned = vector_from_rotation(state.rotations @ design.positions.rotations.transpose(0, 2, 1))
    return np.concatenate([state.origins, turned], axis=1)
