"""Stores with figures that are made up, and pages read back."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import closing
from html.parser import HTMLParser
from itertools import product
from pathlib import Path
from typing import Any

from ballplate.extensions.sweeps.result import SweepResult
from ballplate.extensions.sweeps.running import stored_result
from ballplate.extensions.sweeps.store import Store, add_rows, add_sweep, open_store
from ballplate.extensions.sweeps.task import CellResult

VERSIONS = (("ballplate", "0.1.0"), ("python", "3.11"))
VOID = {"meta", "link", "br", "hr", "img", "input", "col"}


def axis(
    name: str, labels: Sequence[str], values: Sequence[float] = (), unit: str = ""
) -> dict[str, Any]:
    """An axis as a store's definition has it."""
    column = f"{name}_{unit}" if unit in ("m", "rad") else name
    return {
        "name": name,
        "column": column,
        "unit": unit,
        "labels": list(labels),
        "values": list(values),
    }


def made_up(
    path: Path,
    title: str,
    axes: list[dict[str, Any]],
    rows: Iterable[CellResult],
    trials: int | None = None,
    record: Sequence[str] = ("U2", "U4", "U6"),
) -> Store:
    """A store of a sweep over all combinations of the axes' values, without files."""
    store = open_store(path, create=True)
    definition = {
        "title": title,
        "source": "made-up.yaml",
        "base": "base.yaml",
        "sweep": {},
        "experiment": {"title": "made up"},
        "files": {},
        "axes": axes,
        "cells": [list(cell) for cell in product(*(range(len(one["labels"])) for one in axes))],
        "trials": trials,
        "seed": 1,
        "record": list(record),
    }
    add_rows(store, add_sweep(store, definition), rows)
    return store


def made_up_result(path: Path, *arguments: Any, **options: Any) -> SweepResult:
    """The sweep of a made-up store."""
    with closing(made_up(path, *arguments, **options)) as store:
        return stored_result(store)


def done(cell: int, figures: dict[str, float], **details: Any) -> CellResult:
    """A row of a cell that is done."""
    return CellResult(
        cell,
        0,
        f"key {cell}",
        "done",
        seed=cell,
        figures=figures,
        details=details,
        versions=VERSIONS,
    )


def failed(cell: int, reason: str) -> CellResult:
    """A row of a cell that has failed."""
    return CellResult(cell, 0, f"key {cell}", "failed", reason, versions=VERSIONS)


class Page(HTMLParser):
    """What a page consists of: tags with attributes, places of tables, ids, texts by tag."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.open: list[str] = []
        self.texts: dict[str, list[str]] = {}
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)
            self.texts.setdefault(tag, []).append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, {name: value or "" for name, value in attrs}))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        for tag in set(self.open):
            self.texts[tag][-1] += data

    def of(self, tag: str) -> list[dict[str, str]]:
        """Attributes of all elements of a kind."""
        return [attributes for name, attributes in self.tags if name == tag]
