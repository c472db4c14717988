"""Error model of the user's own, in Python."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from ballplate.simulator.inputs import UNKNOWN, Settings, Trust
from ballplate.simulator.machines import Corner, ErrorModel, ErrorModelKind
from pydantic import Field, PrivateAttr, StringConstraints

from .custom import custom_model


class PythonSettings(Settings):
    """A user's own error model, made by a Python function from the volume's corners and the
    options.
    """

    kind: Literal["python"] = Field(description="a model of the user's own")
    object: Annotated[str, StringConstraints(min_length=1)] = Field(
        description=(
            "module:function, the module installed or in this file's folder, or the name of an"
            " installed entry point of the group ballplate.error_models."
        )
    )
    options: dict[str, Any] = Field(
        default={}, description="Keyword arguments of the function; quantities arrive in SI units."
    )

    folder: str | None = Field(
        default=None,
        description=("Folder of the module, relative to this file; default: that of this file."),
    )

    # An additional folder of modules.
    _folder: Path | None = PrivateAttr(default=None)
    _trust: Trust = PrivateAttr(default=UNKNOWN)


def _read(settings: PythonSettings, folder: Path, trust: Trust) -> PythonSettings:
    """Return the settings with the folder of modules: that of the experiment file, or the stated
    one relative to it.
    """
    place = folder if settings.folder is None else folder / settings.folder
    return settings.completed(_folder=place, _trust=trust)


def _build(settings: PythonSettings, lower: Corner, upper: Corner) -> ErrorModel:
    return custom_model(
        settings.object, settings.options, settings._folder, settings._trust, lower, upper
    )


SETTINGS = PythonSettings
ERROR_MODEL = ErrorModelKind(PythonSettings, _build, read=_read, is_code=True)
