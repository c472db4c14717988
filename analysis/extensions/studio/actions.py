"""Actions on a design: operations in the studio, as changes of the file.

An action has its name under `do`, and arguments. A new one is a function and its line in `ACTIONS`.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from ballplate.extensions.repair.changes import (
    free_name,
    middle_of,
    scale_readings,
    with_added,
    with_position,
)
from ballplate.extensions.repair.mending import changes_of, with_experiment, with_text_changes
from ballplate.extensions.repair.written import Edit, edits
from ballplate.extensions.repair.yamltext import TextChange
from ballplate.simulator.computing import comparable
from ballplate.simulator.experiment import Experiment, Position, ReadingGroup
from ballplate.simulator.geometry import AXIS_INDEX, QUARTER_TURNS, Pose, plane_rotation
from ballplate.simulator.inputs import (
    ExperimentError,
    Steps,
    length_text,
    parse_tree,
    to_list,
    to_python,
    typed_length,
)
from ballplate.simulator.machines import Array

from .document import DesignDocument, changed
from .drafts import draft_of, draft_with, entries_of
from .filling import filled

# Places are written to this many metres, a hundredth of a millimetre.
STEP = 1e-5

AXES = tuple(AXIS_INDEX)

# Places along an axis of a pool that fills the volume.
MOST_PLACES = 20

# Keys of an item that could be had at a price, beside its own.
PRICED = ("name", "price")

# What an action makes of a design: another experiment, changes of the file, or another text.
Outcome = Experiment | Sequence[TextChange] | str


class ActionError(ValueError):
    """An action is unknown, or lacks an argument, which the text names."""


@dataclass(frozen=True, eq=False)
class Action:
    """An action with its arguments on the design of a document.

    :raises ActionError: from every property, an argument is invalid.
    """

    document: DesignDocument
    arguments: Mapping[str, Any]

    def __getitem__(self, name: str) -> Any:
        return self.arguments[name]

    def get(self, name: str, default: Any = None) -> Any:
        """Return an argument that may be absent."""
        return self.arguments.get(name, default)

    @cached_property
    def draft(self) -> Experiment:
        """The experiment with its faults."""
        return draft_of(self.document, planning=True)

    @property
    def position(self) -> Position:
        """The position that is named."""
        return self.position_of(self["position"])

    def position_of(self, name: Any) -> Position:
        """Return the position of a name.

        :raises ActionError: there is none.
        """
        places = {place.name: place for place in self.draft.positions}
        return places[_known("position", name, places)]

    @property
    def entry(self) -> Steps:
        """The path of the position that is named, which may not be understood."""
        names = [str(entry.get("name")) for entry in entries_of(self.draft)]
        return ("positions", names.index(_known("position", self["position"], names)))

    def vector(self, name: str) -> Array:
        """Return an argument with a co-ordinate for each axis."""
        dimension = self.draft.dimension
        try:
            vector = np.array(self[name], float)
        except (TypeError, ValueError):
            vector = np.zeros(())
        if vector.ndim != 1 or not np.isfinite(vector).all():
            raise ActionError(f"{self[name]!r} is no vector")
        if len(vector) != dimension:
            raise ActionError(f"{name} has {len(vector)} co-ordinates in {dimension} dimensions")
        return vector

    def outcome(self) -> Outcome:
        """Return what the action makes of the design.

        :raises ActionError: the action is unknown or incomplete.
        :raises ExperimentError: the text cannot be understood.
        """
        name = str(self.get("do"))
        work = ACTIONS[_known("action", name, ACTIONS)]
        try:
            return work(self)
        except KeyError as error:
            raise ActionError(f"{name} needs {error}") from None


def done(document: DesignDocument, arguments: Mapping[str, Any]) -> DesignDocument:
    """Return the document after an action.

    :raises ActionError: the action is unknown or incomplete.
    :raises ExperimentError: the text is invalid, or cannot be changed in this way.
    """
    action = Action(document, arguments)
    text = action.outcome()
    if isinstance(text, Experiment):
        text = with_experiment(document.text, document.path, action.draft, text)
    elif not isinstance(text, str):
        text = with_text_changes(document.text, document.path, document.variant, text)
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ActionError(f"{error.object[error.start]!r} is no character of a file") from None
    return changed(document, text)


def draft_after(document: DesignDocument, arguments: Mapping[str, Any]) -> Experiment:
    """Return the experiment with its faults after an action that is not written.

    :raises ActionError, ExperimentError: as for `done`, except that a file may not express it.
    """
    action = Action(document, arguments)
    outcome = action.outcome()
    if isinstance(outcome, str):
        return draft_of(replace(document, text=outcome))
    if isinstance(outcome, Experiment):
        outcome = [*changes_of(action.draft, edits(action.draft, outcome))]
    return draft_with(action.draft, outcome)


def _moved(action: Action) -> Outcome:
    """Move a position by given metres along each axis."""
    return _placed(action.draft, action.position, action.vector("by"))


def _turned(action: Action) -> Outcome:
    """Turn a position by quarter-turns about the middle of its balls, in their own plane."""
    turn = np.eye(action.draft.dimension)
    turn[:2, :2] = QUARTER_TURNS[int(action.get("quarter_turns", 1)) % 4]
    place = action.position
    return _placed(action.draft, place, rotation=place.pose.rotation @ turn)


def _stood(action: Action) -> Outcome:
    """Place a position across another axis, its middle unchanged."""
    if action.draft.dimension == 2:
        raise ActionError("a plane machine has no axis normal to a plate")
    axis = action["across"]
    if axis not in AXIS_INDEX:
        raise ActionError(f"across is x, y or z, not {axis}")
    return _placed(action.draft, action.position, rotation=plane_rotation(axis, 0))


def _copied(action: Action) -> Outcome:
    """Copy a position at its location."""
    return with_added(action.draft, action.position)


def _put(action: Action) -> Outcome:
    """Add a position like the one that is named or the last one, or else across z with all balls
    and probes: with the middle of its balls at a point, or far from the others without one; as
    near to it as its scale readings lie within the volume, so that a plate stands on the floor.
    """
    draft = action.draft
    if action.get("like") is not None:
        place = action.position_of(action["like"])
    else:
        place = draft.positions[-1] if draft.positions else _whole(draft)
    place = replace(place, name=free_name(draft, place.name), enabled=True)
    low, high = _free_motion(draft, place)
    if (low > high + STEP).any():
        k = int((low - high).argmax())
        excess = length_text(round(float(low[k] - high[k]), 9))
        raise ActionError(
            f"position {place.name} has no room along {AXES[k]}: its readings span {excess} more"
            " than the volume; choose a smaller plate"
        )
    if action.get("at") is not None:
        by = np.clip(action.vector("at") - _middle(draft, place), low, high)
        return _placed(draft, place, by)
    steps = np.stack(np.meshgrid(*zip(low, (low + high) / 2.0, high, strict=True)), axis=-1)
    motions = steps.reshape(-1, draft.dimension)
    taken = np.array([_middle(draft, other) for other in draft.positions] or [low * np.nan])
    apart = np.linalg.norm(_middle(draft, place) + motions[:, None] - taken, axis=2).min(axis=1)
    return _placed(draft, place, motions[int(np.argmax(comparable(np.nan_to_num(apart))))])


def _free_motion(experiment: Experiment, place: Position) -> tuple[Array, Array]:
    """Return how far a position can move (d,) back and forth along each axis, in metres, with its
    scale readings within the volume.
    """
    rows = scale_readings(place, experiment.layouts[place.artefact], experiment.probes)
    volume = experiment.machine.volume
    return volume.lower - rows.min(axis=0), volume.upper - rows.max(axis=0)


def _whole(experiment: Experiment) -> Position:
    """Return a position of the first artefact with all its balls and probes."""
    for artefact, layout in experiment.layouts.items():
        d, every = experiment.dimension, np.arange(len(layout.names))
        group = ReadingGroup(tuple(experiment.probes), layout.names, every, 1)
        return Position("position", artefact, Pose(np.eye(d), np.zeros(d)), (group,))
    raise ActionError("no artefact to put there; add one")


def _fitted(action: Action) -> Outcome:
    """Move the positions that leave the volume into it, as they lie in the space that all take."""
    fitted = action.draft
    enabled = [place for place in fitted.positions if place.enabled]
    if not enabled:
        raise ActionError("no position to fit")
    readings = [
        scale_readings(place, fitted.layouts[place.artefact], fitted.probes) for place in enabled
    ]
    low, high = (np.array([end(rows, axis=0) for rows in readings]) for end in (np.min, np.max))
    was_free = (high.max(axis=0) - low.min(axis=0)) - (high - low)
    is_free = np.maximum(fitted.machine.volume.size - (high - low), 0.0)
    share = np.where(was_free > STEP, (low - low.min(axis=0)) / np.maximum(was_free, STEP), 0.5)
    lowest, highest = fitted.machine.volume.of_readings
    outside = np.flatnonzero(((low < lowest) | (high > highest)).any(axis=1)).tolist()
    if not outside:
        raise ActionError("all positions lie within the volume; correct what is said of them")
    for k in outside:
        excess = high[k] - low[k] - (highest - lowest)
        if (excess > 0.0).any():
            axis = int(excess.argmax())
            span = length_text(round(float((high - low)[k, axis]), 9))
            raise ActionError(
                f"position {enabled[k].name} takes {span}"
                f" along {AXES[axis]}, more than the volume; choose a smaller plate, or turn it"
            )
        by = fitted.machine.volume.lower + share[k] * is_free[k] - low[k]
        fitted = _placed(fitted, enabled[k], by)
    return fitted


def _read_with(action: Action) -> Outcome:
    """Read everything of a position with other probes."""
    return _with_groups(action, probes=tuple(map(str, action["probes"])))


def _read_balls(action: Action) -> Outcome:
    """Read other balls of a position, all with the same probes."""
    every = action.draft.layouts[action.position.artefact].names
    indices = sorted({every.index(_known("ball", name, every)) for name in action["balls"]})
    if not indices:
        raise ActionError("a position reads some ball")
    balls = tuple(every[k] for k in indices)
    return _with_groups(action, balls=balls, ball_indices=np.array(indices, np.intp))


def _with_groups(action: Action, **changes: Any) -> Experiment:
    place = action.position
    if len(place.readings) > 1:
        text = f'position "{place.name}" has several groups of readings; change them in the text'
        raise ActionError(text)
    groups = tuple(replace(group, **changes) for group in place.readings)
    return with_position(action.draft, replace(place, readings=groups))


def _added(action: Action) -> Outcome:
    """Add a position as a file states it, such as a suggestion."""
    return [TextChange(("positions",), to_list(action["settings"]), "append")]


def _removed(action: Action) -> Outcome:
    """Remove a position."""
    if len(entries_of(action.draft)) == 1:
        return [TextChange(action.entry[:1], [])]
    return [TextChange(action.entry, kind="remove")]


def _switched_off(action: Action) -> Outcome:
    """Keep a position in the file, and do not read it."""
    return [TextChange((*action.entry, "enabled"), False)]


def _switched_on(action: Action) -> Outcome:
    """Read a position that was switched off."""
    return [TextChange((*action.entry, "enabled"), kind="remove")]


def _repaired(action: Action) -> Outcome:
    """Apply the edits of a suggested repair to the file."""
    needed = [
        Edit(_steps(edit["path"]), to_list(edit["value"]), bool(edit["is_new"]))
        for edit in action["edits"]
    ]
    return [*changes_of(action.draft, needed)]


def _planned(action: Action) -> Outcome:
    """Read the positions of a plan in its order, and have its certificates; other positions are
    switched off and stay in the file, as does the pool, less the certificates, which could be had
    twice otherwise.
    """
    data = to_python(action.draft.tree)
    chosen = {str(settings["name"]): settings for settings in to_list(action["positions"])}
    read = {
        str(entry.get("name")): k
        for k, entry in enumerate(entries_of(action.draft))
        if entry.get("enabled", True)
    }
    new, count = [name for name in chosen if name not in read], len(data.get("positions") or ())
    index = read | {name: count + k for k, name in enumerate(new)}
    off = [TextChange(("positions", read[k], "enabled"), False) for k in read if k not in chosen]
    further = [chosen[name] | {"name": free_name(action.draft, name)} for name in new]
    return [
        *off,
        *(TextChange(("positions",), settings, "append") for settings in further),
        *_in_sequence(count + len(new), [index[name] for name in chosen]),
        *_had(data, action.get("calibration", ())),
    ]


def _in_sequence(count: int, sequence: Sequence[int]) -> list[TextChange]:
    """Return the change that puts some of `count` positions in sequence, at the places that they
    have together; none if they are.
    """
    order = [*range(count)]
    for place, k in zip(sorted(sequence), sequence, strict=True):
        order[place] = k
    return [] if order == [*range(count)] else [TextChange(("positions",), order, "order")]


def _had(data: Any, names: Container[str]) -> list[TextChange]:
    """Return the changes that make calibration of items of the pool."""
    priced = (data.get("pool") or {}).get("calibration") or ()
    had = [k for k, item in enumerate(priced) if item["name"] in names]
    items = [{key: priced[k][key] for key in priced[k] if key not in PRICED} for k in had]
    return [
        *(TextChange(("calibration",), to_list(item), "append") for item in items),
        *_without(data, ("pool", "calibration"), had),
    ]


def _without(data: Any, steps: Steps, indices: Sequence[int]) -> list[TextChange]:
    """Return the changes that remove entries of a list, and what holds nothing else."""
    above = [data]
    for step in steps if indices else ():
        above.append(above[-1][step])
    if len(indices) < len(above[-1]):
        return [TextChange((*steps, k), kind="remove") for k in sorted(indices, reverse=True)]
    while len(steps) > 1 and len(above[len(steps) - 1]) == 1:
        steps = steps[:-1]
    return [TextChange(steps, kind="remove")]


def _filled(action: Action) -> Outcome:
    """Fill the volume with a pool, in planes with the probes of each, in place of its groups."""
    layouts, probes = action.draft.layouts, action["probes"]
    artefact = action.get("artefact") or next(iter(layouts))
    try:
        probes = {plane: [*map(str, names)] for plane, names in probes.items() if names}
        turns, count = [*map(int, action["quarter_turns"])], int(action["count"])
    except (AttributeError, TypeError, ValueError):
        raise ActionError("give probes by plane, quarter turns, and the count of places") from None
    if not set(turns) <= {0, 1, 2, 3} or not 1 <= count <= MOST_PLACES:
        raise ActionError(f"quarter turns are 0 to 3, and places along an axis 1 to {MOST_PLACES}")
    for name in sum(probes.values(), []):
        _known("probe", name, action.draft.probes)
    return filled(action.draft, _known("artefact", artefact, layouts), probes, turns, count)


def _forbidden(action: Action) -> Outcome:
    """Forbid artefacts in the pool to enter a corner of the volume, a quarter of each edge, by its
    low or high end along each axis.
    """
    volume, corner = action.draft.machine.volume, action["corner"]
    is_high = [_known("end", end, ("low", "high")) == "high" for end in corner][: len(volume.size)]
    start = np.where(is_high, volume.upper - volume.size / 4.0, volume.lower)
    ends = zip(AXIS_INDEX, start, start + volume.size / 4.0, strict=False)
    box = {axis: [typed_length(low), typed_length(high)] for axis, low, high in ends}
    return [TextChange(("pool", "limits", "forbidden"), box, "append")]


def _set(action: Action) -> Outcome:
    """Set a value at a path, in the form of a file; an absent value removes it, an entry of a list
    with what holds nothing else, and one at a last step of + is a further entry of a list.
    """
    steps, text = _steps(action["path"]), str(action["value"])
    if steps[-1] == "+":
        return [TextChange(steps[:-1], value_of(text), "append")]
    if not text.strip():
        if isinstance(steps[-1], int):
            return _without(to_python(action.draft.tree), steps[:-1], [steps[-1]])
        return [TextChange(steps, kind="remove")]
    return [TextChange(steps, value_of(text))]


def _written(action: Action) -> Outcome:
    """Replace the text."""
    return str(action["text"])


def _steps(path: Any) -> Steps:
    """Return the path of a value.

    :raises ActionError: it is none.
    """
    if not isinstance(path, list) or not path:
        raise ActionError("a path is a list of keys and indices")
    return tuple(step if isinstance(step, int) else str(step) for step in path)


def value_of(text: str) -> Any:
    """A value as a person types it in a form, in one line, as a file would state it.

    :raises ActionError: it is no value.

    >>> value_of("[1 m, 2]"), value_of("0.2 um")
    (['1 m', 2], '0.2 um')
    """
    try:
        return to_list(to_python(parse_tree(f"value: {text}\n", "value"))["value"])
    except (ExperimentError, TypeError, KeyError):
        raise ActionError(f"{text} is no value of a file") from None


def _placed(
    experiment: Experiment, place: Position, by: Array | float = 0.0, rotation: Array | None = None
) -> Experiment:
    """Return the experiment with a position, the middle of its balls moved or turned about, at
    whole steps.
    """
    rotation = place.pose.rotation if rotation is None else rotation + 0.0
    middle = _middle(experiment, place) + by
    origin = middle - rotation @ _middle_of_balls(experiment, place)
    origin = np.round(np.round(origin / STEP) * STEP, 9) + 0.0
    return with_position(experiment, replace(place, pose=Pose(rotation, origin)))


def _middle(experiment: Experiment, place: Position) -> Array:
    """Return the middle of a position's balls in the machine."""
    return place.pose.rotation @ _middle_of_balls(experiment, place) + place.pose.origin


def _middle_of_balls(experiment: Experiment, place: Position) -> Array:
    return middle_of(experiment.layouts[place.artefact])[: experiment.dimension]


def _known(noun: str, name: Any, names: Container[str]) -> str:
    """Return a name that is one of several.

    :raises ActionError: it is not.
    """
    if not isinstance(name, str) or name not in names:
        raise ActionError(f'no {noun} "{name}"')
    return name


ACTIONS: Mapping[str, Callable[[Action], Outcome]] = {
    "move": _moved,
    "turn": _turned,
    "stand": _stood,
    "copy": _copied,
    "add": _added,
    "repair": _repaired,
    "plan": _planned,
    "fill": _filled,
    "forbid": _forbidden,
    "remove": _removed,
    "off": _switched_off,
    "on": _switched_on,
    "put": _put,
    "fit": _fitted,
    "probes": _read_with,
    "balls": _read_balls,
    "set": _set,
    "text": _written,
}
