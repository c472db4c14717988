"""Keys of the true machine, the source of simulated readings."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args

from ballplate.simulator.inputs.open_kinds import OpenKinds
from ballplate.simulator.inputs.quantity_types import Angle, PositiveLength
from ballplate.simulator.inputs.settings import Settings
from pydantic import Field

from .protocol import Corner, ErrorModel, TrueMachine
from .settings import ErrorModelSettings, with_defaults


class ZeroSettings(Settings):
    """A machine without errors."""

    kind: Literal["zero"] = Field(default="zero", description="no errors")


OTHER_MODEL = "Error model of the true machine, if it differs from the estimated one."


class CoefficientSettings(Settings):
    """A machine with stated errors."""

    kind: Literal["coefficients"] = Field(description="stated errors")
    values: dict[str, str] = Field(
        description=(
            "Value with unit of each parameter that is not zero, by its name in the error model or"
            ' in the monomial form, for example "EXX t^2": 3 um.'
        )
    )
    error_model: ErrorModelSettings | None = Field(  # type: ignore[valid-type]
        default=None, description=OTHER_MODEL
    )


class RandomSettings(Settings):
    """A machine whose errors are drawn at random with stated sizes."""

    kind: Literal["random"] = Field(description="errors drawn at random")
    position: PositiveLength | None = Field(
        default=None,
        description="Root mean square of each positional error along its axis, or in the volume.",
    )
    rotation: Angle | None = Field(
        default=None,
        description="Root mean square of each rotational error along its axis, or in the volume.",
    )
    seed: int = Field(default=1, ge=0, description="Seed of the draw.")
    error_model: ErrorModelSettings | None = Field(  # type: ignore[valid-type]
        default=None, description=OTHER_MODEL
    )


class FurtherTrueMachine(Settings):
    """A true machine that an extension provides, in a module whose `read` completes it from its
    files and reports faults.
    """

    def true_machine(self, fitted: ErrorModel, lower: Corner, upper: Corner) -> TrueMachine:
        """Return the machine in a volume, in the frame of the model that is fitted."""
        raise NotImplementedError


OF_KERNEL = (ZeroSettings, CoefficientSettings, RandomSettings)
KINDS = tuple(kind for keys in OF_KERNEL for kind in get_args(keys.model_fields["kind"].annotation))

if TYPE_CHECKING:
    TrueMachineSettings = Settings
else:
    TrueMachineSettings = Annotated[
        Union[OF_KERNEL],  # noqa: UP007
        OpenKinds("true_machines", FurtherTrueMachine),
    ]


def with_model_defaults(settings: Any, dimension: int) -> Any:
    """Return settings of a true machine whose own error model, if any, states the defaults for the
    number of dimensions.
    """
    model = getattr(settings, "error_model", None)
    if model is None:
        return settings
    return settings.model_copy(update={"error_model": with_defaults(model, dimension)})
