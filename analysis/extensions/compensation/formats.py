"""The formats of compensation tables; a new one is a file and a line here."""

from __future__ import annotations

from .heidenhain import HEIDENHAIN
from .isg_csv import ISG_CSV
from .iso_csv import ISO_CSV
from .table_formats import TableFormat

FORMATS: dict[str, TableFormat] = {one.name: one for one in (ISO_CSV, ISG_CSV, HEIDENHAIN)}
