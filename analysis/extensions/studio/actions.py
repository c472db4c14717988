"""Actions on a design: operations in the studio, as changes of the file's text.

An action is a mapping with its name under `do` and its arguments. A new one is a function and its
line in `ACTIONS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import replace
from typing import Any

import numpy as np
from ballplate.extensions.repair.changes import with_pose, with_position
from ballplate.extensions.repair.mending import (
    changes_of,
    with_experiment,
    with_text_changes,
)
from ballplate.extensions.repair.placing import middle_of
from ballplate.extensions.repair.positions import with_added
from ballplate.extensions.repair.written import Edit
from ballplate.extensions.repair.yamltext import TextChange
from ballplate.simulator.experiment import Experiment, Position, ReadingGroup
from ballplate.simulator.geometry import QUARTER_TURNS, Pose, ball_coordinates, plane_rotation
from ballplate.simulator.inputs import ExperimentError, Steps, parse_tree, to_python
from ballplate.simulator.machines import Array

from .document import DesignDocument, changed
from .drafts import draft_of
from .filling import added, filling, refilled, taken

Arguments = Mapping[str, Any]

# Places are written to this many metres, a hundredth of a millimetre.
STEP = 1e-5

# Places along an axis of a pool that fills the volume.
MOST_PLACES = 20


class ActionError(ValueError):
    """An action is unknown, or lacks an argument, which the text names."""


def done(document: DesignDocument, action: Arguments) -> DesignDocument:
    """Return the document after an action.

    :raises ActionError: the action is unknown or incomplete.
    :raises ExperimentError: the text is invalid, or cannot be changed in this way.
    """
    name = action.get("do")
    if not isinstance(name, str) or name not in ACTIONS:
        raise ActionError(f"no action {name!r}; there are {', '.join(ACTIONS)}")
    try:
        text = ACTIONS[name](document, action)
    except KeyError as error:
        raise ActionError(f"{name} needs {error}") from None
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise ActionError(f"{error.object[error.start]!r} is no character of a file") from None
    return changed(document, text)


def _moved(document: DesignDocument, action: Arguments) -> str:
    """Move a position by given metres along each axis."""
    by = _vector(action["by"])

    def move(experiment: Experiment, place: Position) -> Pose:
        if len(by) != experiment.dimension:
            raise ActionError(f"by has {len(by)} co-ordinates in {experiment.dimension} dimensions")
        return Pose(place.pose.rotation, place.pose.origin + by)

    return _posed(document, str(action["position"]), move)


def _turned(document: DesignDocument, action: Arguments) -> str:
    """A position by quarter-turns about the middle of its balls, in their own plane."""
    turns = int(action.get("quarter_turns", 1)) % 4

    def turn(experiment: Experiment, place: Position) -> Pose:
        by = np.eye(experiment.dimension)
        by[:2, :2] = QUARTER_TURNS[turns]
        return _about_middle(experiment, place, place.pose.rotation @ by)

    return _posed(document, str(action["position"]), turn)


def _stood(document: DesignDocument, action: Arguments) -> str:
    """Place a position across another axis, its middle unchanged."""
    axis = str(action["across"])
    if axis not in ("x", "y", "z"):
        raise ActionError(f"across is x, y or z, not {axis}")

    def stand(experiment: Experiment, place: Position) -> Pose:
        if experiment.dimension == 2:
            raise ActionError("a plane machine has no axis normal to a plate")
        return _about_middle(experiment, place, plane_rotation(axis, 0))

    return _posed(document, str(action["position"]), stand)


def _posed(
    document: DesignDocument, name: str, pose: Callable[[Experiment, Position], Pose]
) -> str:
    experiment = draft_of(document, planning=True)
    place = _position(experiment, name)
    position_pose = pose(experiment, place)
    new = with_pose(experiment, name, _rounded(position_pose))
    return with_experiment(document.text, document.path, experiment, new)


def _rounded(pose: Pose) -> Pose:
    """Return a pose whose origin is written to whole steps."""
    origin = np.round(np.round(pose.origin / STEP) * STEP, 9)
    return Pose(pose.rotation, origin + 0.0)


def _about_middle(experiment: Experiment, place: Position, rotation: Array) -> Pose:
    middle = middle_of(experiment.layouts[place.artefact])[: experiment.dimension]
    centre = place.pose.rotation @ middle + place.pose.origin
    rotation = rotation + 0.0
    return Pose(rotation, centre - rotation @ middle)


def _copied(document: DesignDocument, action: Arguments) -> str:
    """Copy a position at its location."""
    experiment = draft_of(document, planning=True)
    new = with_added(experiment, _position(experiment, str(action["position"])))
    return with_experiment(document.text, document.path, experiment, new)


def _added(document: DesignDocument, action: Arguments) -> str:
    """A position as a file states it, such as a suggestion or one that was switched off."""
    settings = _plain(action["settings"])
    return _with(document, [TextChange(("positions",), settings, "append")])


def _planned(document: DesignDocument, action: Arguments) -> str:
    """The positions and certificates of a plan: other positions are switched off and stay in the
    file, as does the pool, less the certificates, which could be had twice otherwise.
    """
    data = _plain(to_python(draft_of(document, planning=True).tree))
    entries = data.get("positions") or ()
    chosen = {str(settings["name"]): settings for settings in _plain(action["positions"])}
    is_read = {str(entry["name"]): entry.get("enabled", True) for entry in entries}
    changes = [
        TextChange(("positions", k, "enabled"), False)
        for k, (name, enabled) in enumerate(is_read.items())
        if enabled and name not in chosen
    ]
    for name, settings in chosen.items():
        if not is_read.get(name):
            number = 2
            while settings["name"] in is_read:
                settings["name"], number = f"{name} ({number})", number + 1
            changes.append(TextChange(("positions",), settings, "append"))
    return _with(document, changes + _had(data, set(action.get("calibration", ()))))


def _had(data: Any, names: Set[str]) -> list[TextChange]:
    """The changes of a file's `data` that make calibration out of items of its pool."""
    pool = data.get("pool") or {}
    priced = pool.get("calibration") or ()
    chosen = [k for k, entry in enumerate(priced) if str(entry["name"]) in names]
    if not chosen:
        return []
    items = [
        {key: value for key, value in priced[k].items() if key not in ("name", "price")}
        for k in chosen
    ]
    steps: Steps = ("pool", "calibration")
    changes = [TextChange(("calibration",), item, "append") for item in items]
    if not data.get("calibration"):
        changes = [TextChange(("calibration",), items)]
    gone = [(*steps, k) for k in chosen[::-1]]
    if len(gone) == len(priced):
        gone = [steps if len(pool) > 1 else ("pool",)]
    return changes + [TextChange(where, kind="remove") for where in gone]


def _filled(document: DesignDocument, action: Arguments) -> str:
    """A pool that fills the volume, in planes with the probes of each, in place of its groups."""
    experiment = draft_of(document)
    artefact = str(action.get("artefact") or next(iter(experiment.layouts)))
    if artefact not in experiment.layouts:
        raise ActionError(f"no artefact {artefact}")
    try:
        probes = {str(plane): [*map(str, some)] for plane, some in action["probes"].items()}
        turns, count = [*map(int, action["quarter_turns"])], int(action["count"])
    except (AttributeError, TypeError, ValueError):
        raise ActionError("give probes by plane, quarter turns, and the count of places") from None
    if not set(turns) <= {0, 1, 2, 3} or not 1 <= count <= MOST_PLACES:
        raise ActionError(f"quarter turns are 0 to 3, and places along an axis 1 to {MOST_PLACES}")
    groups = filling(experiment, artefact, probes, turns, count)
    return _with(document, refilled(to_python(experiment.tree), artefact, groups))


def _limited(document: DesignDocument, action: Arguments) -> str:
    """A further entry of a list of the pool's limits: a forbidden box, or a candidate left out."""
    data = to_python(draft_of(document).tree)
    return _with(document, [added(data, _limit(action), _plain(action["entry"]))])


def _lifted(document: DesignDocument, action: Arguments) -> str:
    """The pool without an entry of a list of its limits."""
    steps, data = _limit(action), to_python(draft_of(document).tree)
    entries = ((data.get("pool") or {}).get("limits") or {}).get(steps[-1]) or ()
    index = int(action["index"])
    if not 0 <= index < len(entries):
        raise ActionError(f"no pool.limits.{steps[-1]}[{index}]")
    return _with(document, [taken(data, steps, index)])


def _limit(action: Arguments) -> Steps:
    if action["limit"] not in ("forbidden", "at_most"):
        raise ActionError("a limit is forbidden or at_most")
    return ("pool", "limits", str(action["limit"]))


def _repaired(document: DesignDocument, action: Arguments) -> str:
    """Apply the edits of a suggested repair to the file."""
    text = document.text
    experiment = draft_of(document, planning=True)
    needed = [
        Edit(_steps(edit["path"]), _plain(edit["value"]), bool(edit["is_new"]))
        for edit in action["edits"]
    ]
    changes = changes_of(experiment, needed)
    return with_text_changes(text, document.path, document.variant, changes)


def _removed(document: DesignDocument, action: Arguments) -> str:
    """The design without a position."""
    steps, count = _place_of(document, str(action["position"]))
    if count == 1:
        return _with(document, [TextChange(("positions",), [])])
    return _with(document, [TextChange(steps, kind="remove")])


def _switched_off(document: DesignDocument, action: Arguments) -> str:
    """A position stays in the file, and is not read."""
    steps, _ = _place_of(document, str(action["position"]))
    return _with(document, [TextChange((*steps, "enabled"), False)])


def _switched_on(document: DesignDocument, action: Arguments) -> str:
    """A position that was switched off is read again."""
    steps, _ = _place_of(document, str(action["position"]))
    return _with(document, [TextChange((*steps, "enabled"), kind="remove")])


def _put(document: DesignDocument, action: Arguments) -> str:
    """A further position with the middle of its balls at a point, like the one that is named or
    the last one, or else across z with all balls and probes.
    """
    at = _vector(action["at"])
    experiment = draft_of(document, planning=True)
    if len(at) != experiment.dimension:
        raise ActionError(f"at has {len(at)} co-ordinates in {experiment.dimension} dimensions")
    name = action.get("like")
    if name is None and not experiment.positions:
        new = _whole(experiment)
    else:
        new = experiment.positions[-1] if name is None else _position(experiment, str(name))
    middle = middle_of(experiment.layouts[new.artefact])[: len(at)]
    pose = _rounded(Pose(new.pose.rotation, at - new.pose.rotation @ middle))
    with_new = with_added(experiment, replace(new, pose=pose, enabled=True))
    return with_experiment(document.text, document.path, experiment, with_new)


def _whole(experiment: Experiment) -> Position:
    """Return a position of the first artefact with all its balls and probes."""
    for artefact, layout in experiment.layouts.items():
        d, every = experiment.dimension, np.arange(len(layout.names))
        group = ReadingGroup(tuple(experiment.probes), layout.names, every, 1)
        return Position("position", artefact, Pose(np.eye(d), np.zeros(d)), (group,))
    raise ActionError("no artefact to put there; add one")


def _fitted(document: DesignDocument, action: Arguments) -> str:
    """All positions moved so that they fill the volume as they filled the space that they take."""
    experiment = draft_of(document, planning=True)
    enabled = [place for place in experiment.positions if place.enabled]
    if not enabled:
        raise ActionError("no position to fit")
    ends = np.array([_ends(experiment, place) for place in enabled])
    lowest, highest = ends[:, 0].min(axis=0), ends[:, 1].max(axis=0)
    volume, new = experiment.machine.volume, experiment
    for place, (low, high) in zip(enabled, ends, strict=True):
        was_free = (highest - lowest) - (high - low)
        is_free = np.maximum((volume.upper - volume.lower) - (high - low), 0.0)
        share = np.where(was_free > STEP, (low - lowest) / np.maximum(was_free, STEP), 0.5)
        by = volume.lower + share * is_free - low
        pose = _rounded(Pose(place.pose.rotation, place.pose.origin + by))
        new = with_pose(new, place.name, pose)
    return with_experiment(document.text, document.path, experiment, new)


def _ends(experiment: Experiment, place: Position) -> Array:
    """Return the lowest and the highest scale readings (2, d) of a position."""
    balls = ball_coordinates(place.pose, experiment.layouts[place.artefact])
    readings = np.concatenate(
        [
            balls[group.ball_indices] - experiment.probes[probe].offset
            for group in place.readings
            for probe in group.probes
        ]
    )
    return np.array([readings.min(axis=0), readings.max(axis=0)])


def _read_with(document: DesignDocument, action: Arguments) -> str:
    """Everything of a position read with other probes."""
    probes = tuple(str(probe) for probe in action["probes"])
    return _with_groups(document, action, lambda group: replace(group, probes=probes))


def _read_balls(document: DesignDocument, action: Arguments) -> str:
    """Other balls of a position read, all with the same probes."""
    names = tuple(str(ball) for ball in action["balls"])
    experiment = draft_of(document, planning=True)
    place = _position(experiment, str(action["position"]))
    every = experiment.layouts[place.artefact].names
    unknown = [name for name in names if name not in every]
    if unknown or not names:
        raise ActionError(f"no ball {unknown[0]}" if unknown else "a position reads some ball")
    index = np.array(sorted(every.index(name) for name in set(names)), np.intp)
    balls = tuple(every[k] for k in index)
    return _with_groups(
        document, action, lambda group: replace(group, balls=balls, ball_indices=index)
    )


def _with_groups(
    document: DesignDocument, action: Arguments, change: Callable[[ReadingGroup], ReadingGroup]
) -> str:
    experiment = draft_of(document, planning=True)
    place = _position(experiment, str(action["position"]))
    if len(place.readings) > 1:
        text = f'position "{place.name}" has several groups of readings; change them in the text'
        raise ActionError(text)
    groups = tuple(map(change, place.readings))
    new = with_position(experiment, replace(place, readings=groups))
    return with_experiment(document.text, document.path, experiment, new)


def _set(document: DesignDocument, action: Arguments) -> str:
    """Set a value at a path, in the form of a file; an absent value removes it, and one at a last
    step of + is a further entry of a list.
    """
    steps = _steps(action["path"])
    text = str(action["value"])
    if steps[-1] == "+":
        return _with(document, [TextChange(steps[:-1], value_of(text), "append")])
    if not text.strip():
        return _with(document, [TextChange(steps, kind="remove")])
    return _with(document, [TextChange(steps, value_of(text))])


def value_of(text: str) -> Any:
    """A value as a person types it in a form, in one line, as a file would state it.

    :raises ActionError: it is no value.

    >>> value_of("[1 m, 2]"), value_of("0.2 um")
    (['1 m', 2], '0.2 um')
    """
    try:
        return _plain(to_python(parse_tree(f"value: {text}\n", "value"))["value"])
    except (ExperimentError, TypeError, KeyError):
        raise ActionError(f"{text} is no value of a file") from None


def _written(document: DesignDocument, action: Arguments) -> str:
    """Another text."""
    return str(action["text"])


def _with(document: DesignDocument, changes: Sequence[TextChange]) -> str:
    return with_text_changes(document.text, document.path, document.variant, changes)


def _position(experiment: Experiment, name: str) -> Position:
    for place in experiment.positions:
        if place.name == name:
            return place
    raise ActionError(f'no position "{name}"')


def _place_of(document: DesignDocument, name: str) -> tuple[Steps, int]:
    """Return the path of a position, and the number of positions."""
    tree = to_python(draft_of(document, planning=True).tree)
    entries = tree.get("positions") or ()
    for i, entry in enumerate(entries):
        if isinstance(entry, Mapping) and str(entry.get("name")) == name:
            return ("positions", i), len(entries)
    raise ActionError(f'no position "{name}"')


def _vector(value: Any) -> Array:
    try:
        vector = np.array(value, float)
    except (TypeError, ValueError):
        raise ActionError(f"{value!r} is no vector") from None
    if vector.ndim != 1 or not np.isfinite(vector).all():
        raise ActionError(f"{value!r} is no vector")
    return vector


def _steps(value: Any) -> Steps:
    if not isinstance(value, list) or not value:
        raise ActionError("a path is a list of keys and indices")
    return tuple(step if isinstance(step, int) else str(step) for step in value)


def _plain(value: Any) -> Any:
    """Plain data with lists for tuples."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value


ACTIONS: Mapping[str, Callable[[DesignDocument, Arguments], str]] = {
    "move": _moved,
    "turn": _turned,
    "stand": _stood,
    "copy": _copied,
    "add": _added,
    "repair": _repaired,
    "plan": _planned,
    "fill": _filled,
    "limit": _limited,
    "lift": _lifted,
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
