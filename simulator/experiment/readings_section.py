"""The keys of an experiment's `readings`: where the laboratory's tables are, and how they are
written.
"""

from __future__ import annotations

import re
from typing import Annotated, Literal

from ballplate.simulator.geometry.ball_layouts import Coordinates
from ballplate.simulator.inputs.settings import Forms, Name, NonEmpty, Settings, Text, shorten
from ballplate.simulator.machines.protocol import TrueMachine
from pydantic import Field, PrivateAttr

Coordinate = Literal["scale readings", "ball centres", "part"]

Columns = Forms[Name, Name, Annotated[dict[Name, Name], Field(min_length=1)]]
_COORDINATE = "its name or number, or {probe: column, …} if each probe has a column"


class CompensationSettings(Settings):
    """The machine's own correction that was on, to be taken off the readings."""

    file: Text = Field(description="machine file (YAML) of the correction, as for ballplate map")

    # That of the file; set when the experiment is loaded.
    _machine: TrueMachine | None = PrivateAttr(default=None)

    def machine(self) -> TrueMachine:
        """What the correction added to scale readings."""
        assert self._machine is not None
        return self._machine


class ColumnsSettings(Settings):
    """Columns of a table of readings: the name in the table or the number of each, from 1.

    A text that begins with = is the same in all rows.
    """

    position: Name | None = Field(None, description="names of positions; or =NAME, of all rows")
    ball: Name | None = Field(None, description="names of balls")
    probe: Name | None = Field(None, description="names of probes; or =NAME, of all rows")
    x: Columns | None = Field(None, description=_COORDINATE)
    y: Columns | None = Field(None, description=_COORDINATE)
    z: Columns | None = Field(None, description=_COORDINATE)
    axis: Name | None = Field(None, description="axes x, y and z of a table with one row per axis")
    value: Name | None = Field(None, description="co-ordinates of a table with one row per axis")
    u: Name | None = Field(
        None, description="standard uncertainties of each co-ordinate; or =0.2 um, of all rows"
    )


class ReadingsSettings(Settings):
    """The laboratory's readings: where they are and how they are written."""

    files: Forms[Text, NonEmpty[Text], Text] | None = Field(
        None,
        description="table or report of readings, or list of these, for fit without READINGS",
    )
    names: Text | None = Field(
        None,
        description=(
            "rule by which reports of measuring programs, or a column of a table, name features:"
            " position, ball, probe and run in braces, * for anything; default: found in the report"
        ),
    )
    probes: dict[Name, Name] | None = Field(
        None, description="name of a probe in reports and tables → its name in this file"
    )
    columns: ColumnsSettings | None = Field(
        None, description="columns of the table, if their names do not identify them"
    )
    unit: Text | None = Field(
        None, description="unit of columns that state none: mm, um, m, in or another length unit"
    )
    decimal: Literal["point", "comma"] | None = Field(
        None, description="point or comma before decimals; default: found in the table"
    )
    separator: Literal["comma", "semicolon", "tab", "bar", "space"] | None = Field(
        None, description="separator of columns; default: found in the table"
    )
    encoding: Text | None = Field(
        None, description="encoding of the table, such as cp1250; default: UTF-8, 16 or cp1252"
    )
    header: Annotated[int, Field(ge=0, strict=True)] | None = Field(
        None, description="number of the line with the names of columns, 0 without one"
    )
    fill_down: bool | None = Field(
        None,
        description=(
            "true: blank names of position, ball and probe are those above, as below merged cells;"
            " default: asked for"
        ),
    )
    sheet: Text | None = Field(
        None,
        description="sheet of a workbook, or all: as several tables; default: the only table",
    )
    swap_names: bool | None = Field(
        None,
        description=(
            "true: if readings show that the names of two balls of a position are swapped, swap"
            " and report them; default: refuse them"
        ),
    )
    coordinates: Coordinate | None = Field(
        None,
        description=(
            "scale readings (default), ball centres, to which the measuring program has"
            " added the probe's offset, or part: ball centres in a part's co-ordinate"
            " system, another in each position"
        ),
    )
    offsets_in_controller: dict[Name, Coordinates] | None = Field(
        None,
        description=(
            "name → offset that the measuring program has applied to ball centres, if it is not"
            " that of probes"
        ),
    )
    compensation: Forms[Literal["on", "off"], Literal["on", "off"], CompensationSettings] | None = (
        Field(
            None,
            description=(
                "whether the machine's own correction was on; or {file: machine.yaml}, which was"
                " on and is subtracted"
            ),
        )
    )

    @property
    def named_files(self) -> tuple[str, ...]:
        """Names of the tables, as they are written."""
        if self.files is None:
            return ()
        return (self.files,) if isinstance(self.files, str) else tuple(self.files)


def no_settings() -> ReadingsSettings:
    """The settings of an experiment that says nothing of its readings."""
    return ReadingsSettings.model_construct()


PLACES = ("position", "ball", "probe", "run")
PLACE = re.compile(r"\{([^{}]*)\}")


def check_rule(rule: str) -> str:
    """Return a valid rule.

    :raises ValueError: it has no ball, or an unknown or repeated field.
    """
    place_holders = PLACE.findall(rule)
    unknown = [name for name in place_holders if name not in PLACES]
    if unknown or "{" in PLACE.sub("", rule) or "}" in PLACE.sub("", rule):
        subject = f'"{shorten(unknown[0])}"' if unknown else "a brace without its other one"
        raise ValueError(f"{subject} in a rule of names; known: {', '.join(PLACES)}, in braces")
    if "ball" not in place_holders or len(set(place_holders)) < len(place_holders):
        raise ValueError(f'"{shorten(rule)}" needs {{ball}}, and each place at most once')
    return rule
