"""A user's own error model: imported by name, called, and checked against the protocol.

Errors in the user's code become messages about the experiment file, with their location in that
code.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from ballplate.simulator.inputs import (
    OwnCodeError,
    Trust,
    error_text,
    hint,
    listing,
    own_array,
    own_frame,
    own_modules,
    own_result,
    running_own_code,
    with_quantities,
)
from ballplate.simulator.machines import (
    Array,
    CustomModelError,
    ErrorModel,
    Line,
    Parameter,
    Reported,
)

GROUP = "ballplate.error_models"
MEMBERS = ("dimension", "parameters", "error", "jacobian", "reported")

# Parameters are tried at values that move points by about this much, in metres.
USUAL_ERROR = 1e-4
# Errors beyond it, in metres, are those of no machine.
IMPLAUSIBLE = 0.1

Result = TypeVar("Result")


def custom_model(
    name: str,
    options: Mapping[str, Any],
    folder: Path | None,
    trust: Trust,
    lower: tuple[float, ...],
    upper: tuple[float, ...],
) -> ErrorModel:
    """Return the model that the object `name` makes for a volume.

    `name` is module:function or an entry point's name. Modules are searched where Python finds
    them, then in `folder`. Quantities in options, such as "200 mm", arrive in SI units.

    :raises CustomModelError: no such object, or its result is no error model.
    """
    return _built(named_object(name, folder, trust), name, _Options(options), lower, upper)


class _Options(dict[str, Any]):
    """Options of a model by which it is found again."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(repr(self))


# Once, so that what is used is what was checked, where a fault becomes a message of its file.
@lru_cache(16)
def _built(
    build: Callable[..., Any],
    name: str,
    options: _Options,
    lower: tuple[float, ...],
    upper: tuple[float, ...],
) -> ErrorModel:
    key = "options" if options else "object"
    model = attempt(
        f"{name} has failed", lambda: build(lower, upper, **with_quantities(options)), key
    )
    corners = np.asarray(lower, float), np.asarray(upper, float)
    return attempt(f"what {name} returns has failed", lambda: _checked(name, model, *corners))


@dataclass(frozen=True)
class GuardedModel:
    """A user's error `model`; every array it returns is checked."""

    model: ErrorModel
    dimension: int
    parameters: tuple[Parameter, ...]
    as_reported: Reported

    def error(self, x: Array, a: Array, p: Array) -> Array:
        return own_array(self.model.error, x.shape, x, a, p, is_plausible=self._is_plausible(a))

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        shape = (*x.shape, len(self.parameters))
        return own_array(self.model.jacobian, shape, x, a, p, is_plausible=self._is_plausible(a))

    def _is_plausible(self, a: Array) -> bool:
        # Diverging fits try parameters of no real machine; their errors are not the user's.
        effects = (parameter.effect for parameter in self.parameters)
        moved = (abs(value) * effect for value, effect in zip(a.tolist(), effects, strict=True))
        return all(length <= IMPLAUSIBLE for length in moved)

    def reported(self) -> Reported:
        return self.as_reported


class GuardedModelWithLines(GuardedModel):
    """A guarded model whose error functions can be drawn."""

    def lines(self, function: str, t: Array) -> tuple[Line, ...]:
        lines: tuple[Line, ...] = own_result(self.model.lines, function, t)  # type: ignore[attr-defined]
        return lines


def named_object(
    name: str, folder: Path | None, trust: Trust, group: str = GROUP
) -> Callable[..., Any]:
    """Return the callable `name`, module:function or an entry point's name of a `group`.

    All imports of code that a file names happen here.

    :raises CustomModelError: it is missing, not callable, or not trusted.
    """
    if not trust.modules:
        text = "is code in Python that loading the file would run, and modules are not allowed here"
        raise CustomModelError(f"{text}; {trust.remedy}")
    module_name, colon, path = name.partition(":")
    if not colon:
        from importlib.metadata import entry_points

        points = entry_points(group=group)
        if name not in points.names:
            raise CustomModelError(
                f'no entry point "{name}" of the group {group} is installed;'
                f" {hint(name, sorted(points.names))}; for an object of a module write module:name"
            )
        target = attempt(f'the entry point "{name}" cannot be loaded', points[name].load)
    else:
        target = _imported(module_name, folder)
        for part in path.split("."):
            if not hasattr(target, part):
                members = [word for word in vars(target) if not word.startswith("_")]
                raise CustomModelError(f'{module_name} has no "{part}"; {hint(part, members)}')
            target = getattr(target, part)
    if not callable(target):
        raise CustomModelError(f"{name} cannot be called; name a function or a class")
    return target


def _imported(name: str, folder: Path | None) -> Any:
    beside = None if folder is None else module_file(folder.resolve(), name)
    if beside is not None:
        own_modules().add(str(folder.resolve()) if folder is not None else "", name)
        # A file may be newer than what was listed of the folder.
        importlib.invalidate_caches()
    try:
        module = attempt(f"{name} cannot be imported", lambda: importlib.import_module(name))
    except CustomModelError as error:
        absent = error.__cause__.name if isinstance(error.__cause__, ModuleNotFoundError) else None
        if absent in name.split("."):
            where = "" if folder is None else f" nor in {folder}"
            raise CustomModelError(
                f"no module {name} is installed{where}; install it, or correct its name"
            ) from None
        raise
    origin = getattr(module, "__file__", None)
    if beside is not None and origin is not None and Path(origin).resolve() != beside:
        raise CustomModelError(f"another module {name} was found at {origin}; rename {beside.name}")
    return module


def module_source(name: str, folder: Path | None) -> Path | None:
    """Return the file of an object's module; ``None`` if there is no such file.

    `name` is module:function or an entry point's name. Neither the module nor its packages are
    run.
    """
    module, colon, _ = name.partition(":")
    if not colon:
        from importlib.metadata import entry_points

        points = entry_points(name=name)
        module = next(
            (point.module for point in points if point.group.startswith("ballplate.")), ""
        )
    if not module:
        return None
    beside = None if folder is None else module_file(folder.resolve(), module)
    if beside is not None:
        return beside
    locations = None
    spec = None
    parts = module.split(".")
    for count in range(1, len(parts) + 1):
        finders = (getattr(finder, "find_spec", None) for finder in sys.meta_path)
        whole = ".".join(parts[:count])
        specs = (find(whole, locations) for find in finders if find is not None)
        spec = next(filter(None, specs), None)
        if spec is None:
            return None
        locations = spec.submodule_search_locations
    return None if spec is None or not spec.has_location else Path(str(spec.origin))


def module_file(folder: Path, name: str) -> Path | None:
    """Return the file of a module in a folder, if any."""
    path = folder.joinpath(*name.split("."))
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


def attempt(failure: str, call: Callable[[], Result], key: str = "object") -> Result:
    """Return the result of a call of a user's code.

    `failure` opens the message.

    :raises CustomModelError: the call fails; the message has the location.
    """
    try:
        with running_own_code():
            return call()
    except CustomModelError:
        raise
    except OwnCodeError as error:
        raise CustomModelError(f"{failure}: {error}", key) from error
    except (Exception, SystemExit) as error:
        # Without a frame in the user's code, the call itself is at fault.
        text = error_text(error, own_frame(error))
        raise CustomModelError(f"{failure}: {text}", key) from error


# In one piece: each check relies on the checks before it.
def _checked(name: str, model: Any, lower: Array, upper: Array) -> ErrorModel:
    """Return a model, guarded, or raise its first fault."""
    missing = [
        member
        for member in MEMBERS
        if not hasattr(type(model), member) and not hasattr(model, member)
    ]
    if missing:
        raise CustomModelError(
            f"what {name} returns, {type(model).__name__}, has no {listing(missing)}; add them"
        )
    d = len(lower)
    dimension = attempt(f"{name}: dimension has failed", lambda: model.dimension)
    if dimension != d:
        raise CustomModelError(
            f"{name}: dimension is {dimension}, but machine.volume has {d} dimensions"
        )
    parameters = attempt(f"{name}: parameters has failed", lambda: tuple(model.parameters))
    _check_parameters(name, parameters)
    n = len(parameters)
    reported = attempt(f"{name}: reported has failed", model.reported)
    shape = np.asarray(getattr(reported, "matrix", 0.0)).shape
    if (
        shape != (len(getattr(reported, "names", ())), n)
        or len(getattr(reported, "units", ())) != shape[0]
    ):
        raise CustomModelError(
            f"{name}: reported() has a matrix of shape {shape}; one row for each name is needed"
        )
    kind = GuardedModelWithLines if hasattr(model, "lines") else GuardedModel
    guarded = kind(model, d, parameters, reported)
    x = np.linspace(lower, upper, 7)
    for a in (np.zeros(n), USUAL_ERROR / np.array([one.effect for one in parameters])):
        guarded.error(x, a, np.zeros_like(x))
        guarded.jacobian(x, a, np.zeros_like(x))
    return guarded


def _check_parameters(name: str, parameters: tuple[Any, ...]) -> None:
    if not parameters:
        raise CustomModelError(f"{name}: there are no parameters; an error model has at least one")
    for parameter in parameters:
        if not isinstance(parameter, Parameter):
            raise CustomModelError(
                f"{name}: parameters has an entry of type {type(parameter).__name__}; each must be"
                " a Parameter of ballplate.models"
            )
        if parameter.unit not in ("m", "rad", "1"):
            raise CustomModelError(
                f'{name}: the unit of "{parameter.name}" is "{parameter.unit}"; known: m, rad, 1'
            )
        if not (np.isfinite(parameter.effect) and parameter.effect > 0):
            raise CustomModelError(
                f'{name}: the effect of "{parameter.name}" is {parameter.effect}; give one above 0'
            )
    names = [parameter.name for parameter in parameters]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise CustomModelError(
            f"{name}: several parameters are called {listing(repeated)}; names must differ"
        )
