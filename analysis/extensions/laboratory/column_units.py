"""Units of the columns of lengths: of their headings, of all columns, or of a column of units."""

from __future__ import annotations

from collections.abc import Mapping

from ballplate.simulator.experiment import ReadingsSettings
from ballplate.simulator.inputs import listing, plain_unit

from .heading_words import quoted, unit_of
from .headings import HeadingError
from .table_forms import Form


def units_of_columns(
    form: Form, settings: ReadingsSettings, above: Mapping[str, str]
) -> dict[int, str]:
    """Return units by index of the columns of lengths.

    :raises HeadingError: a column without a unit, or with two.
    """
    roles, headings = form.headings.roles, form.headings
    unit_stated = None if settings.unit is None else plain_unit(settings.unit)
    once = unit_of(above.get("unit", "").rstrip("."))
    if unit_stated and once and unit_stated != once:
        raise HeadingError(
            f"the table says that lengths are in {once}, the experiment file {unit_stated}; correct"
            " readings.unit"
        )
    units: dict[int, str] = {}
    without: list[int] = []
    axes = [axis for group in headings.groups for axis in group.axes]
    for column in [*axes, *([roles["u"]] if "u" in headings.places else [])]:
        unit = column.unit or form.units.get(column.place) or unit_stated or once
        named = headings.name(column.place)
        if column in axes and form.units_of_rows:
            said = {unit or "", *form.units_of_rows} - {""}
            if len(said) > 1:
                text = f'lengths of "{named}" are said to be in {listing(sorted(said))}'
                raise HeadingError(f"{text}; write one unit")
            (unit,) = said
        if unit is None and column is roles.get("u") and not without:
            raise HeadingError(
                f'the column "{named}" of uncertainties has no unit, which may be another than that'
                " of co-ordinates; write it in the heading, as in u_um"
            )
        if unit is None:
            without.append(column.place)
        else:
            units[column.place] = unit
    if without:
        without = [headings.by_axis[1]] if headings.by_axis else without
        names = quoted(map(headings.name, without))
        raise HeadingError(
            f"no unit is stated for the columns {names}; write it under readings: {{unit: mm}}"
            " in the experiment file, or give --unit mm"
        )
    return units
