"""Keys of the true machine, the source of simulated readings."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, PrivateAttr

from ..inputs.quantities import Angle, Length, PositiveLength
from ..inputs.settings import NonEmpty, Settings
from .arrangement_settings import (
    ARRANGEMENT,
    ROTATIONS,
    ArrangementName,
    ArrangementSettings,
    arrangement_of,
)
from .curves import Interpolation, Points, curves_model
from .described import OfMachineFile
from .model_kinds import Corner
from .plane import PlaneModel
from .protocol import ErrorModel, TrueMachine
from .settings import ErrorModelSettings


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


class CurvesSettings(Settings):
    """A machine with measured error curves."""

    kind: Literal["curves"] = Field(description="measured error curves")
    files: NonEmpty[str] = Field(
        description=(
            "CSV files, each with the columns position_mm and errors of one axis such as EXX_um and"
            " EAX_urad; errors that no file has are zero."
        )
    )
    interpolation: Interpolation = Field(
        default="linear",
        description="Interpolation between points: linear, cubic splines, or monotone cubics.",
    )
    arrangement: ArrangementName | ArrangementSettings = Field(
        default="MB2", description=ARRANGEMENT
    )
    rotations: Literal["linearised", "full"] = Field(default="linearised", description=ROTATIONS)

    # Curves by ISO 230-1 name; set when the experiment is loaded.
    _curves: dict[str, Points] = PrivateAttr(default_factory=dict)

    def set_curves(self, curves: dict[str, Points]) -> None:
        """Set the curves of the files."""
        self._curves = curves

    def model(self, lower: Corner, upper: Corner) -> ErrorModel:
        """Return the curves as an error model whose parameters are all one."""
        return curves_model(
            self._curves,
            self.interpolation,
            arrangement_of(self.arrangement),
            lower,
            upper,
            self.rotations == "full",
        )


class TrueMachineFileSettings(OfMachineFile):
    """The machine in a machine file."""

    kind: Literal["machine"] = Field(description="the machine that a file describes")
    file: str = Field(description="Machine file (YAML), as for ballplate map.")
    level: Length | None = Field(
        default=None,
        description=(
            "In two dimensions the position of the z axis; default: that of the reference point."
        ),
    )
    random_part: Literal["omitted"] | None = Field(
        default=None,
        description=(
            '"omitted": simulate without the random part of the file, which machine.repeatability '
            "covers. Without this key, a file with a random part is refused."
        ),
    )

    def machine(self, dimension: int = 3) -> TrueMachine:
        """Return the systematic errors of the machine, in two dimensions those at the level."""
        # Loaded where a machine file is named: few experiments name any.
        from .description import true_volumetric

        machine = true_volumetric(self.described)
        if dimension == 3:
            return machine
        level = self.described.reference[2] if self.level is None else self.level
        return TrueMachine(PlaneModel(machine.model, level), machine.a)


class TrueMapSettings(Settings):
    """The machine of a map file."""

    kind: Literal["map"] = Field(description="the machine that a fit has found")
    file: str = Field(description="Map file, as ballplate fit -o writes it.")
    draw: Annotated[int, Field(ge=0)] | None = Field(
        default=None,
        description=(
            "Seed with which the machine is drawn about the estimates, within their covariance;"
            " default: the estimates themselves."
        ),
    )

    # Content of the file; set when the experiment is loaded.
    _machine: TrueMachine | None = PrivateAttr(default=None)
    _content: str = PrivateAttr(default="")

    def set_machine(self, machine: TrueMachine, content: str) -> None:
        """Set the machine of a map file, and the SHA-256 of its content."""
        self._machine, self._content = machine, content

    def machine(self) -> TrueMachine:
        """Return the estimated or drawn errors."""
        assert self._machine is not None
        return self._machine


TrueMachineSettings = Annotated[
    ZeroSettings
    | CoefficientSettings
    | RandomSettings
    | CurvesSettings
    | TrueMachineFileSettings
    | TrueMapSettings,
    Field(discriminator="kind"),
]
