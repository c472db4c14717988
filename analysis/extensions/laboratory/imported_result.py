"""Readings out of reports of measuring programs, as a result."""

from __future__ import annotations

from dataclasses import dataclass

from ballplate.presentation import Data, Result, picked

from .imported import ImportedReadings


@dataclass(frozen=True)
class ReadReport(Result):
    """Readings of reports; `to_frame` is a table that `fit` accepts.

    `told` lists features used and skipped in each report, `remarks` are further notes.
    """

    label: str
    imported: ImportedReadings
    title: str = "readings of reports of measuring programs"

    @property
    def told(self) -> tuple[str, ...]:
        return self.imported.told

    @property
    def remarks(self) -> tuple[str, ...]:
        return self.imported.remarks

    def headline(self) -> str:
        return f"{len(self.imported.readings)} readings, {self.imported.coordinates}"

    def lines(self) -> list[str]:
        return [*self.told, self.imported.key]

    @property
    def notes(self) -> tuple[str, ...]:
        return self.remarks

    def rows(self) -> list[Data]:
        columns = self.imported.columns()
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def data(self) -> Data:
        return {
            "experiment": self.label,
            "coordinates": self.imported.coordinates,
            "told": self.told,
            "remarks": self.remarks,
            "readings": [
                {
                    **picked(reading, "position", "ball"),
                    "probe": reading.probe or None,
                    "centre": reading.centre[: self.imported.dimension],
                    "uncertainty": reading.uncertainty,
                }
                for reading in self.imported.readings
            ],
        }
