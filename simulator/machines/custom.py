"""A user's own error model: found by name, called, and checked against the protocol.

Whatever goes wrong in the user's code is told as a message about the experiment file, with the
place in that code.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..inputs.own_code import error_text, own_array, own_frame, own_result, running_own_code
from ..inputs.quantities import with_quantities
from ..inputs.settings import hint, listing
from ..inputs.trust import Trust
from .protocol import Array, ErrorModel, Line, Parameter, Reported

GROUP = "ballplate.error_models"
MEMBERS = ("dimension", "parameters", "error", "jacobian", "reported")

# The packages that ballplate consisted of at first, and what models written then are to import in
# their place.
FORMER_PACKAGES = ("simulator", "analysis")
NEW_LINE = "from ballplate.models import Parameter, Reported"

# Parameters are tried at random values that move points by about this much, in metres, and are
# changed by as much.
USUAL_ERROR = 1e-4
# Errors beyond it, in metres, are those of no machine.
IMPLAUSIBLE = 0.1
# Largest difference of a derivative from the quotient of differences, in parts of the parameter's
# stated effect.
DERIVATIVE = 1e-4

Result = TypeVar("Result")


class CustomModelError(ValueError):
    """A user's error model cannot be used; `key` of its settings, "object" or "options", is where
    to look.
    """

    def __init__(self, text: str, key: str = "object") -> None:
        self.key = key
        super().__init__(text)


def custom_model(
    name: str,
    options: Mapping[str, Any],
    folder: Path | None,
    trust: Trust,
    lower: tuple[float, ...],
    upper: tuple[float, ...],
) -> ErrorModel:
    """The model that the object `name`, module:function or an entry point's name, returns for a
    volume.

    Modules are looked for where Python finds them and then in `folder`. Options that are
    quantities, such as "200 mm", arrive in metres, radians, kelvins or as ratios.

    :raises CustomModelError: no such object, or what it returns is no error model.
    """
    build = named_object(name, folder, trust)
    key = "options" if options else "object"
    model = attempt(
        f"{name} has failed", lambda: build(lower, upper, **with_quantities(options)), key
    )
    _check(name, model, np.asarray(lower, float), np.asarray(upper, float))
    kind = GuardedModelWithLines if hasattr(model, "lines") else GuardedModel
    return kind(model, tuple(model.parameters))


@dataclass(frozen=True)
class GuardedModel:
    """A user's error `model`, whose every answer is checked."""

    model: ErrorModel
    parameters: tuple[Parameter, ...]

    @property
    def dimension(self) -> int:
        return self.model.dimension

    def error(self, x: Array, a: Array, p: Array) -> Array:
        return own_array(self.model.error, x.shape, x, a, p, is_plausible=self._is_plausible(a))

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        shape = (*x.shape, len(self.parameters))
        return own_array(self.model.jacobian, shape, x, a, p, is_plausible=self._is_plausible(a))

    def _is_plausible(self, a: Array) -> bool:
        """Whether a machine may have such errors; a fit that diverges tries others."""
        effects = (parameter.effect for parameter in self.parameters)
        moved = (abs(value) * effect for value, effect in zip(a.tolist(), effects, strict=True))
        return all(length <= IMPLAUSIBLE for length in moved)

    def reported(self) -> Reported:
        found: Reported = own_result(self.model.reported)
        return found


class GuardedModelWithLines(GuardedModel):
    """The same of a model whose error functions can be drawn."""

    def lines(self, function: str, t: Array) -> tuple[Line, ...]:
        found: tuple[Line, ...] = own_result(self.model.lines, function, t)  # type: ignore[attr-defined]
        return found


def named_object(
    name: str, folder: Path | None, trust: Trust, group: str = GROUP
) -> Callable[..., Any]:
    """The object `name`, module:function or an entry point's name of a `group`.

    Nothing else imports code that a file names.

    :raises CustomModelError: there is none, it cannot be called, or it is not trusted.
    """
    if not trust.modules:
        text = "is code in Python that loading the file would run, and modules are not allowed here"
        raise CustomModelError(f"{text}; {trust.remedy}")
    module_name, colon, path = name.partition(":")
    if not colon:
        from importlib.metadata import entry_points

        found = entry_points(group=group)
        if name not in found.names:
            known = sorted(found.names)
            text = f'no entry point "{name}" of the group {group} is installed; {hint(name, known)}'
            raise CustomModelError(f"{text}; for an object of a module write module:name")
        built = attempt(f'the entry point "{name}" cannot be loaded', found[name].load)
    else:
        built = _imported(module_name, folder)
        for part in path.split("."):
            if not hasattr(built, part):
                known = [word for word in vars(built) if not word.startswith("_")]
                raise CustomModelError(f'{module_name} has no "{part}"; {hint(part, known)}')
            built = getattr(built, part)
    if not callable(built):
        raise CustomModelError(f"{name} cannot be called; name a function or a class")
    return built


def _imported(name: str, folder: Path | None) -> Any:
    beside = None if folder is None else module_file(folder.resolve(), name)
    if beside is not None:
        # For other processes too, which are given this process's path; last, so that nothing else
        # is hidden.
        own = str(folder.resolve()) if folder is not None else ""
        if own not in sys.path:
            sys.path.append(own)
        # A file may be newer than what was listed of the folder.
        importlib.invalidate_caches()
    try:
        module = attempt(f"{name} cannot be imported", lambda: importlib.import_module(name))
    except CustomModelError as error:
        absent = error.__cause__.name if isinstance(error.__cause__, ModuleNotFoundError) else None
        if absent is not None and absent.partition(".")[0] in FORMER_PACKAGES:
            text = (
                f"{name} imports {absent}, which is no longer a package of its own; write:"
                f" {NEW_LINE}"
            )
            raise CustomModelError(text) from None
        if absent in name.split("."):
            where = "" if folder is None else f" nor in {folder}"
            raise CustomModelError(
                f"no module {name} is installed{where}; install it, or correct its name"
            ) from None
        raise
    found = getattr(module, "__file__", None)
    if beside is not None and found is not None and Path(found).resolve() != beside:
        raise CustomModelError(f"another module {name} was found at {found}; rename {beside.name}")
    return module


def module_source(name: str, folder: Path | None) -> Path | None:
    """The file of the module of an object, module:function or an entry point's name; None where
    there is none. Nothing of it is run, nor of the packages that it is in.
    """
    module, colon, _ = name.partition(":")
    if not colon:
        from importlib.metadata import entry_points

        points = entry_points(name=name)
        module = next((one.module for one in points if one.group.startswith("ballplate.")), "")
    if not module:
        return None
    beside = None if folder is None else module_file(folder.resolve(), module)
    if beside is not None:
        return beside
    places: Sequence[str] | None = None
    spec = None
    parts = module.split(".")
    for count in range(1, len(parts) + 1):
        finders = (getattr(finder, "find_spec", None) for finder in sys.meta_path)
        whole = ".".join(parts[:count])
        specs = (find(whole, places) for find in finders if find is not None)
        spec = next((one for one in specs if one is not None), None)
        if spec is None:
            return None
        places = spec.submodule_search_locations
    return None if spec is None or not spec.has_location else Path(str(spec.origin))


def module_file(folder: Path, name: str) -> Path | None:
    """The file of a module in a folder, None where it is not there."""
    path = folder.joinpath(*name.split("."))
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


def attempt(what: str, call: Callable[[], Result], key: str = "object") -> Result:
    """The result of a call of a user's code.

    :raises CustomModelError: it fails; says where.
    """
    try:
        with running_own_code():
            return call()
    except (Exception, SystemExit) as error:
        # Without a place in the user's code, the call itself was wrong.
        text = error_text(error, own_frame(error))
        raise CustomModelError(f"{what}: {text}", key) from error


# In one piece: each check of a model relies on those before it.
def _check(name: str, model: Any, lower: Array, upper: Array) -> None:
    """Raise what is wrong with a model, the first thing that is."""
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
    generator = np.random.default_rng(np.random.SeedSequence(1))
    x = lower + (upper - lower) * generator.random((7, d))
    p = 0.05 * float((upper - lower).max()) * generator.standard_normal((7, d))
    effect = np.array([parameter.effect for parameter in parameters])
    n = len(parameters)

    def values(what: str, call: Callable[[], Any], shape: tuple[int, ...]) -> Array:
        found = np.asarray(attempt(f"{name}: {what} has failed", call))
        if found.shape != shape:
            raise CustomModelError(
                f"{name}: {what} returns the shape {found.shape}; {shape} is needed"
            )
        if found.dtype.kind not in "fiu" or not np.isfinite(found).all():
            raise CustomModelError(f"{name}: {what} returns values that are not finite numbers")
        return np.asarray(found, float)

    without = values("error(x, 0, p)", lambda: model.error(x, np.zeros(n), p), (7, d))
    if np.abs(without - p).max() > 1e-12:
        raise CustomModelError(
            f"{name}: error(x, 0, p) is not p; without errors the correction is the probe offset"
        )
    a = USUAL_ERROR / effect * generator.standard_normal(n)
    jacobian = values("jacobian(x, a, p)", lambda: model.jacobian(x, a, p), (7, d, n))
    one, other = (
        attempt(f"{name}: jacobian has failed", lambda: model.jacobian(x, a, p)) for _ in range(2)
    )
    if (
        not isinstance(one, np.ndarray)
        or one.dtype != float
        or not one.flags.writeable
        or np.shares_memory(one, other)
    ):
        raise CustomModelError(
            f"{name}: jacobian returns no new array of floats; make one at each call"
        )
    for k, parameter in enumerate(parameters):
        step = np.zeros(n)
        step[k] = USUAL_ERROR / effect[k]
        after = values("error(x, a, p)", lambda step=step: model.error(x, a + step, p), (7, d))  # type: ignore[misc]
        before = values("error(x, a, p)", lambda step=step: model.error(x, a - step, p), (7, d))  # type: ignore[misc]
        quotient = (after - before) / (2.0 * step[k])
        if np.abs(jacobian[:, :, k] - quotient).max() > DERIVATIVE * effect[k]:
            worst = np.unravel_index(np.abs(jacobian[:, :, k] - quotient).argmax(), quotient.shape)
            raise CustomModelError(
                f'{name}: jacobian is not the derivative of error by "{parameter.name}":'
                f" {jacobian[(*worst, k)]:.6g} "
                f"instead of {quotient[worst]:.6g} in {'xyz'[int(worst[1])]}, at x ="
                f" {x[worst[0]].round(4).tolist()}"
            )
    reported = attempt(f"{name}: reported has failed", model.reported)
    shape = np.asarray(getattr(reported, "matrix", 0.0)).shape
    if (
        shape != (len(getattr(reported, "names", ())), n)
        or len(getattr(reported, "units", ())) != shape[0]
    ):
        raise CustomModelError(
            f"{name}: reported() has a matrix of shape {shape}; one row for each name is needed"
        )


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
    twice = sorted({one for one in names if names.count(one) > 1})
    if twice:
        raise CustomModelError(
            f"{name}: several parameters are called {listing(twice)}; names must differ"
        )
