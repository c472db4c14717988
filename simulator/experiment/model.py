"""An experiment as the rest of the program sees it: in metres, defaults filled in, names
resolved.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from ballplate.simulator.design.objects import Machine, Noise
from ballplate.simulator.design.observations.calibration import Calibration
from ballplate.simulator.geometry.ball_layouts import ArtefactSettings, BallLayout
from ballplate.simulator.geometry.poses import Pose
from ballplate.simulator.inputs.messages import ExperimentError, Message, Steps, format_path
from ballplate.simulator.inputs.number_arrays import Array, Indices
from ballplate.simulator.inputs.quantities import Target
from ballplate.simulator.inputs.trust import UNKNOWN, Trust
from ballplate.simulator.inputs.yamltree import Mark, Node, mark_of, to_python, written

from .changes import changed_tree
from .earlier_campaigns import EarlierCampaign, MapData, MapShare
from .readings_section import ReadingsSettings, no_settings
from .sections import InfluenceSettings

if TYPE_CHECKING:
    from ballplate.simulator.design.observations.star import Star
    from ballplate.simulator.machines.protocol import Unit


@dataclass(frozen=True, eq=False)
class Probe:
    """A probe: the ``offset`` (d,) of its tip from the machine's reference point, in metres.

    ``standard_uncertainty``: (d,) of an estimated offset, infinite if unknown, None for an exact
    offset. ``angles``: A and B of an articulating head, in radians, if these state the offset.
    """

    name: str
    offset: Array
    standard_uncertainty: Array | None = None
    angles: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        self.offset.setflags(write=False)

    @property
    def is_estimated(self) -> bool:
        """True if the offset is a parameter."""
        return self.standard_uncertainty is not None

    @property
    def certified(self) -> list[tuple[int, float, float]]:
        """Axis, value and standard uncertainty where an estimated offset has one."""
        u = self.standard_uncertainty
        axes = [] if u is None else np.flatnonzero(np.isfinite(u)).tolist()
        return [(k, float(self.offset[k]), float(u[k])) for k in axes if u is not None]


@dataclass(frozen=True, eq=False)
class ReadingGroup:
    """Balls read with the same probes: each ball with each probe, ``repeats`` times.

    ``probes``: names. ``balls``: names, ``ball_indices``: (k,) the same as indices into the
    layout. ``standard_uncertainty``: (d,) metres of each reading, None for the machine's
    repeatability.
    """

    probes: tuple[str, ...]
    balls: tuple[str, ...]
    ball_indices: Indices
    repeats: int
    standard_uncertainty: Array | None = None

    @property
    def count(self) -> int:
        """Number of readings, every repeat counted."""
        return len(self.probes) * len(self.balls) * self.repeats


@dataclass(frozen=True, eq=False)
class Position:
    """A position of an artefact, its nominal pose in the machine and its readings.

    ``description`` completes a short name; possibly empty. One that is not ``enabled`` is not read,
    and no experiment that can be evaluated has it. ``room`` (2, d) are the least and
    greatest shifts within reach of its probes, and ``parts`` the co-ordinates by axis for
    which the file states a part of this room, both in metres.
    """

    name: str
    artefact: str
    pose: Pose
    readings: tuple[ReadingGroup, ...]
    description: str = ""
    enabled: bool = True
    room: Array = field(default_factory=lambda: np.zeros((2, 3)))
    parts: Mapping[str, float] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Number of readings, every repeat counted."""
        return sum(group.count for group in self.readings)

    @property
    def probes(self) -> tuple[str, ...]:
        """The probes that it is read with, each once, in the order of the file."""
        return tuple(dict.fromkeys(probe for group in self.readings for probe in group.probes))

    @property
    def balls(self) -> Indices:
        """Indices (k,) of the balls that are read, in order."""
        return np.unique(np.concatenate([group.ball_indices for group in self.readings]))


@dataclass(frozen=True, eq=False)
class Prior:
    """Prior knowledge of a parameter, in metres, radians or a ratio.

    ``position`` and ``component``: a pose parameter, by its index in origin and rotation.
    ``probe`` and ``component``: a probe offset. Otherwise ``by_model`` (n,): a linear function of
    the error model's parameters, and with ``by_offset`` of offsets (d,) of probes by name.
    ``mark`` and ``path``: its location in the file. ``unit``: m, rad or 1. ``data``: the readings
    of the map that states it, and ``share`` the parts of its standard uncertainty.
    """

    name: str
    position: str | None
    probe: str | None
    component: int
    by_model: Array
    value: float
    standard_uncertainty: float
    mark: Mark
    path: str = ""
    unit: Unit = "m"
    by_offset: Mapping[str, Array] | None = None
    data: MapData | None = None
    share: MapShare | None = None


@dataclass(frozen=True, eq=False)
class Task:
    """A length for the machine to measure: ``points`` (2, d) in metres, and the probes of its
    ends.

    ``target``: target uncertainty of the task, or else of the file, if either states one.
    """

    name: str
    points: Array
    probes: tuple[str, str]
    target: Target | None


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Evaluation of the machine: ``points`` (n, d) in metres, if requested, the probe, and
    tasks.
    """

    points: Array
    probe: str
    tasks: tuple[Task, ...] = ()


@dataclass(frozen=True)
class ChangeTimes:
    """Seconds that go between positions: for another probe, and for another plane or artefact."""

    probe: float
    plane: float


@dataclass(frozen=True, eq=False)
class Candidate:
    """A position, or a calibration item, that a plan may choose.

    `seconds` is its own duration: set-up, readings and changes of probe within it, or the price of
    a calibration item. `plane` names the axis normal to the artefact, empty for a free pose and
    for a calibration item. `group` is the entry of the pool that it comes from, empty for
    positions that are `drawn`, in the experiment's own list. `settings` is its form in an
    experiment file. `reading_seconds` is the duration of a reading.
    """

    name: str
    item: Position | Calibration
    seconds: float
    plane: str
    group: str
    drawn: bool
    settings: Mapping[str, Any]
    reading_seconds: float = 0.0

    @property
    def readings(self) -> int:
        """Readings that it takes, every repeat counted."""
        return self.item.count if isinstance(self.item, Position) else 0


@dataclass(frozen=True)
class AtMost:
    """A limit: at most `count` of `members`, indices of candidates."""

    members: tuple[int, ...]
    count: int


@dataclass(frozen=True, eq=False)
class Pool:
    """Candidates in order, positions of the experiment itself first, and the limits on choosing
    them.

    `must` are the indices of required ones. `dropped` counts generated candidates that cannot be
    read, or are duplicates, by reason. `forbidden` are the lower and upper ends (n, 2, d) of boxes
    that no artefact may enter, infinite where they are not limited, and `edge` is the margin of a
    plate around its balls, if stated.
    """

    candidates: tuple[Candidate, ...]
    changes: ChangeTimes
    must: tuple[int, ...]
    at_most: tuple[AtMost, ...]
    dropped: Mapping[str, int]
    forbidden: Array
    edge: float | None


@dataclass(frozen=True, eq=False)
class Experiment:
    """A complete experiment, or one variant of it.

    ``name``: of the variant, None without variants. ``probes``: by name. ``layouts``: name of an
    artefact → its balls. ``target_uncertainty`` and ``expected_rank_deficiency``: optional.
    ``coverage_factor`` times the standard uncertainty is compared with targets. ``noise``: of
    simulated readings. ``pool``: candidates of a plan. ``doubts``: possible but improbable
    statements. ``notes``: settings detected in its tables, and what plates no longer span.
    ``readings``: location and form of tables of readings. ``sections``: entries under keys that
    extensions provide. ``extensions``: names of required ones. ``tree``: the file's content without
    variants, ``mark``: the location of the experiment, and ``builder``: function from a tree to an
    experiment, with the ``trust`` in the file. ``switched_off``: names of positions of the file
    that are not read. ``faults``: of an experiment that was loaded with them, to be changed and not
    to be evaluated; otherwise None.
    """

    title: str
    description: str
    name: str | None
    source: Path
    machine: Machine
    error_model: Any
    true_machine: Any
    probes: Mapping[str, Probe]
    artefacts: Mapping[str, ArtefactSettings]
    layouts: Mapping[str, BallLayout]
    positions: tuple[Position, ...]
    calibration: tuple[Calibration, ...]
    evaluation: Evaluation
    target_uncertainty: Target | None
    sigma: Literal["estimated", "given"]
    expected_rank_deficiency: int | None
    seed: int
    tree: Node
    mark: Mark
    builder: Callable[..., Experiment]
    coverage_factor: float = 1.0
    priors: tuple[Prior, ...] = ()
    influences: tuple[InfluenceSettings, ...] = ()
    noise: Noise = Noise()
    trust: Trust = UNKNOWN
    stars: tuple[Star, ...] = ()
    pool: Pool | None = None
    doubts: tuple[str, ...] = ()
    readings: ReadingsSettings = field(default_factory=no_settings)
    notes: tuple[str, ...] = ()
    sections: Mapping[str, Any] = field(default_factory=dict)
    extensions: tuple[str, ...] = ()
    switched_off: tuple[str, ...] = ()
    faults: tuple[Message, ...] | None = None

    @property
    def dimension(self) -> int:
        """Number of co-ordinates, 2 or 3."""
        return self.machine.dimension

    @property
    def earlier_campaigns(self) -> tuple[EarlierCampaign, ...]:
        """The campaigns of all maps that are prior knowledge."""
        shares = (prior.share for prior in self.priors)
        return tuple(dict.fromkeys(share.campaign for share in shares if share is not None))

    def layout_of(self, item: Calibration) -> BallLayout:
        """Return the layout that an item of calibration names its values by; any layout for values
        of the machine.
        """
        return self.layouts[item.artefact or next(iter(self.layouts))]

    def is_observed(self, item: Calibration) -> bool:
        """True if an item is an observation of its own; lengths of standards are read."""
        return not item.artefact or self.artefacts[item.artefact].role == "plate"

    @property
    def certified_offsets(self) -> list[tuple[Probe, int, float, float]]:
        """Probes, axes, values and standard uncertainties of offsets that are estimated and have
        any.
        """
        return [(probe, *offset) for probe in self.probes.values() for offset in probe.certified]

    @property
    def label(self) -> str:
        """Name of the file without its ending, and the variant in brackets."""
        return self.source.stem if self.name is None else f"{self.source.stem}[{self.name}]"

    @property
    def size(self) -> int:
        """Number of balls, balls read at each position and candidate, calibrated values, priors and
        points.
        """
        candidates = () if self.pool is None else self.pool.candidates
        offered = [
            candidate.item for candidate in candidates if isinstance(candidate.item, Position)
        ]
        reading_count = sum(
            len(group.ball_indices)
            for position in (*self.positions, *offered)
            for group in position.readings
        )
        calibration_size = sum(calibration.size for calibration in self.calibration)
        balls = sum(len(layout.names) for layout in self.layouts.values())
        return (
            balls
            + reading_count
            + calibration_size
            + len(self.priors)
            + len(self.evaluation.points)
        )

    def __repr__(self) -> str:
        return f"<Experiment {self.label}: {self.title}>"

    def place(self, steps: Steps) -> Mark:
        """Return the location of a path, or of the experiment if the file does not contain it."""
        return self.mark if written(self.tree, *steps) is None else mark_of(self.tree, steps)

    def message(self, steps: Steps, text: str) -> Message:
        """A message about the value at a path."""
        return self.place(steps).message(format_path(steps), text)

    def refused(self, steps: Steps, text: str) -> ExperimentError:
        """The one error of the experiment, about the value at a path."""
        return ExperimentError([self.message(steps, text)])

    def with_(
        self, changes: Mapping[str, object] | None = None, /, **sections: object
    ) -> Experiment:
        """Return the experiment with some of its entries changed, checked like a file.

        ``changes`` has new values by path, such as ``positions[P1].level`` or
        ``artefacts.plate.size``, like variants of a file; ``sections`` replaces whole entries by
        name. Values are in the form of a file: texts with units, numbers, lists and mappings. None
        removes an entry. A length computed in metres is given as a text with its unit too, as in
        ``f"{length} m"``.

        :raises ExperimentError: a path that does not exist, or an invalid experiment.
        """
        return self.builder(
            changed_tree(self.tree, str(self.source), {**(changes or {}), **sections})
        )

    def with_readings(self, changes: Mapping[str, Any]) -> Experiment:
        """Return the experiment with other keys of `readings`; None leaves one unchanged, and
        columns are added to those stated.

        :raises ExperimentError: they are invalid.
        """
        settings_given = {key: value for key, value in changes.items() if value is not None}
        if not settings_given:
            return self
        old = written(self.tree, "readings")
        settings_before = {} if old is None else to_python(old)
        columns = {**settings_before.get("columns", {}), **settings_given.get("columns", {})}
        merged = {**settings_before, **settings_given, **({"columns": columns} if columns else {})}
        return self.with_(readings=merged)
