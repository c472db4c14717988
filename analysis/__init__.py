"""Planning and evaluation of ball-plate experiments for co-ordinate measuring machines.

`import ballplate as bp` gives the commands as functions, the names of the kernel on which
extensions build, and the functions of extensions, each loaded when it is first used.
"""

import os
import sys

# Python puts the current folder first on the path of `python -m ballplate`. Files there with names
# of modules are not meant for it, so nothing else is imported before, not even `__future__`.
if (
    sys.argv[:1] == ["-m"]
    and sys.orig_argv[-len(sys.argv)].endswith("ballplate")
    and not sys.flags.safe_path
    and sys.path[0] != os.path.dirname(__path__[0])
):
    del sys.path[0]

from typing import Any

import lazy_loader

_loaded, _, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("ballplate")
    try:
        value = _loaded(name)
    except (AttributeError, ModuleNotFoundError):
        if name.startswith("_"):
            raise
        value = None
    if value is None or f"{getattr(value, '__module__', '')}".startswith(f"{__name__}.extensions."):
        # What extensions provide names those that it lacks, and itself where it is missing.
        value = globals()[name] = _of_extension(name)
    return value


def _of_extension(name: str) -> Any:
    from .simulator.inputs.extensions import MissingExtensionError, MissingNameError, function

    try:
        return function(name)
    except KeyError:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}") from None
    except MissingExtensionError as error:
        raise MissingNameError(f"{__name__}.{name}: {error}") from None


def __dir__() -> list[str]:
    from .simulator.inputs.extensions import installed_functions, names

    return sorted({*__all__, "__version__"} - {*names("functions")} | {*installed_functions()})
