"""Whatever stands in the place of a store, or in it: one line that says so, and what can be read is
exported.
"""

from __future__ import annotations

import os
import random
import re
import shutil
import sqlite3
import tempfile
from pathlib import Path

import ballplate as bp
import numpy as np
import pandas
import pytest
from ballplate.cli import main
from ballplate.extensions.sweeps import store_file
from ballplate.extensions.sweeps.model import Sweep
from ballplate.extensions.sweeps.store import (
    Store,
    StoreError,
    add_rows,
    add_sweep,
    open_store,
    results,
)
from ballplate.extensions.sweeps.task import CellResult, CellTask, compute

from tests.extensions.sweeps import wording
from tests.extensions.sweeps.odd_stores import DAMAGED, NO_STORES, by_sql, settled, signed
from tests.extensions.sweeps.support import assert_same, rows, small_sweep
from tests.reference.tables import read_table

NO_TIME = ["duration_s"]

# What no digest covers: the duration, text that is none, and rows that are gone as if they had
# never been written, which are computed again.
HARMLESS = ("seconds a text", "seconds infinite", "no keys", "no definition")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small sweep and of its store."""
    folder = tmp_path_factory.mktemp("made")
    path = small_sweep(folder, 2, "record: [U4]\n")
    assert main(["sweep", str(path), "--workers", "1"]) == 1
    settled(folder / "small.sqlite")
    return folder


@pytest.fixture
def store(made: Path, tmp_path: Path) -> Path:
    """A copy of the store, with the sweep file beside it."""
    for name in ("small.yaml", "quickstart.yaml", "small.sqlite"):
        shutil.copy(made / name, tmp_path)
    return tmp_path / "small.sqlite"


def commands(store: Path, *kinds: str) -> list[list[str]]:
    """Command lines that take a store."""
    folder = store.parent
    every = {
        "sweep": ["sweep", str(folder / "small.yaml"), "--workers", "1"],
        "csv": ["sweep", "--export", str(store), "-o", str(folder / "table.csv")],
        "parquet": ["sweep", "--export", str(store), "-o", str(folder / "table.parquet")],
        **{
            name: [
                "sweep",
                "--report",
                str(store),
                "--format",
                name,
                "-o",
                str(folder / f"report.{name}"),
            ]
            for name in ("html", "text")
        },
    }
    return [every[kind] for kind in kinds or every]


def assert_told_in_lines(err: str, store: Path) -> None:
    """Each line begins with the store, or goes on about failed cells, and none holds a control
    character.
    """
    assert err.endswith("\n") and "Traceback" not in err
    assert err.startswith(f"{store}: "), err
    assert all(line.isprintable() for line in err.splitlines()), err


@pytest.mark.parametrize("name", NO_STORES)
def test_what_is_no_store_is_refused_in_one_line(
    name: str, store: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    NO_STORES[name](store)
    before = store.read_bytes() if store.is_file() else b""
    for arguments in commands(store, "sweep", "csv", "text"):
        assert main(arguments) == 3, arguments
        out, err = capsys.readouterr()
        assert out == "" and err.count("\n") == 1
        assert_told_in_lines(err, store)
        assert ("(format 1)" in err) == (name == "format 1")
    # What belongs to somebody else is left as it is.
    assert before == (store.read_bytes() if store.is_file() else b"")
    assert not [*store.parent.glob("table.*"), *store.parent.glob("report.*")]


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_store_is_refused_and_its_sound_cases_exported(
    name: str, store: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And the file stays as it is."""
    right = rows(store)
    DAMAGED[name](store)
    damaged = store.read_bytes()
    status = main(commands(store, "csv")[0])
    out, err = capsys.readouterr()
    assert status in (0, 3) and out == ""
    if status:
        assert_told_in_lines(err, store)
    table = store.parent / "table.csv"
    if table.exists():
        assert_subset(read_table(table), right)
        assert status == 3 or name in HARMLESS or len(read_table(table)) < 4
    for arguments in commands(store, "text", "sweep"):
        status = main(arguments)
        out, err = capsys.readouterr()
        if name in HARMLESS:
            assert status in (0, 1) or wording.IT_HAS_NONE in err
        else:
            assert status == 3 and out == "" and err.count("\n") == 1
            assert_told_in_lines(err, store)
    if name not in HARMLESS:
        # But for SQLite's header, which says how it writes.
        assert store.read_bytes()[100:] == damaged[100:]


def assert_subset(table: pandas.DataFrame, right: pandas.DataFrame) -> None:
    """Every row of a table is that of its cell."""
    assert set(table["cell"]) <= {0, 1, 2, 3}
    for name in set(table.columns) - set(NO_TIME):
        expected = right.set_index("cell").loc[table["cell"]].reset_index()[name]
        if expected.dtype.kind == table[name].dtype.kind == "f":
            np.testing.assert_array_equal(table[name], expected)
        else:
            assert as_texts(table[name]) == as_texts(expected), name


def as_texts(column: pandas.Series) -> list[str]:
    """Values of a column in words, none where there are none."""
    return ["" if pandas.isna(value) else str(value) for value in column]


def test_digests_notice_one_bit(store: Path, capsys: pytest.CaptureFixture[str]) -> None:
    connection = sqlite3.connect(store)
    (figures,) = connection.execute("SELECT figures FROM result WHERE rowid = 2").fetchone()
    connection.close()
    content = store.read_bytes()
    place = content.index(figures[:64])
    store.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])
    assert main(commands(store, "csv")[0]) == 3
    assert wording.UNREADABLE_CELL_ITS_CONTENT in capsys.readouterr().err
    assert read_table(store.parent / "table.csv")["cell"].tolist() == [0, 2, 3]
    for arguments in commands(store, "html", "sweep"):
        assert main(arguments) == 3
        assert wording.IS_DAMAGED in capsys.readouterr().err
    with pytest.raises(StoreError, match="sweep --export reads the undamaged cases"):
        bp.stored(store)


def many(path: Path, count: int) -> Store:
    """A store of made-up rows on many pages."""
    axis = {"name": "k", "column": "k", "unit": "1", "labels": [str(k) for k in range(count)]}
    definition = {
        "title": "t", "source": "s.yaml", "base": "b.yaml", "sweep": {}, "experiment": {}, "files": {},
        "axes": [{**axis, "values": [float(k) for k in range(count)]}], "cells": [[k] for k in range(count)],
        "trials": None, "seed": 1, "record": ["U4"],
    }  # fmt: skip
    store = open_store(path, create=True)
    made_up = (
        CellResult(
            k,
            0,
            f"2 {k:040d}",
            "done",
            figures={"U4_average_m": k / 7, "U4_undetermined": 0.0},
            versions=(("a", "b"),),
        )
        for k in range(count)
    )
    add_rows(store, add_sweep(store, definition), made_up)
    return store


@pytest.mark.parametrize("what", ["a page", "the end"])
def test_all_but_the_rows_of_the_damaged_pages_survive(
    what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "many.sqlite"
    many(path, 1000).close()
    settled(path)
    content = path.read_bytes()
    size = int.from_bytes(content[16:18], "big")
    place = content.index(f"2 {777:040d}".encode() + b"done")
    if what == "a page":
        start = place // size * size
        path.write_bytes(content[:start] + b"\xa5" * size + content[start + size :])
    else:
        path.write_bytes(content[: len(content) - size])
    assert main(["sweep", "--export", str(path), "-o", str(tmp_path / "t.csv")]) == 3
    err = capsys.readouterr().err
    told = re.search(r"(\d+) unreadable cases?", err)
    # `sweep` refuses such a file.
    assert f"; restore a copy, or {wording.NAME_A_NEW_FILE}" in err
    table = read_table(tmp_path / "t.csv")
    assert told is not None and int(told[1]) == 1000 - len(table)
    # Of those on one page, not of any other.
    assert 1 <= int(told[1]) <= size // 40
    assert (table["U4_average_m"] == table["cell"] / 7).all() and (
        table["k"] == table["cell"]
    ).all()


def test_a_report_of_nothing_done_says_so(store: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with sqlite3.connect(store) as connection:
        connection.execute("DELETE FROM result")
    connection.close()
    for arguments in commands(store, "text", "html"):
        assert main(arguments) == 0
        out, err = capsys.readouterr()
        assert out == "" and err.count("\n") == 1 and wording.OF_CELLS_DONE in err
        assert_told_in_lines(err, store)


@pytest.mark.parametrize("what", ["deleted", "replaced", "moved", "a pipe"])
def test_a_store_that_vanishes_while_a_sweep_runs(
    what: str, store: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    original = store.with_name("kept.sqlite")
    shutil.move(store, original)
    other = b"somebody else's"

    def vanishing(loaded: Sweep, task: CellTask) -> CellResult:
        if task.number == 2:
            if what == "moved":
                store.rename(store.with_name("elsewhere.sqlite"))
            else:
                store.unlink()
            if what == "replaced":
                store.write_bytes(other)
            if what == "a pipe":
                os.mkfifo(store)
        return compute(loaded, task)

    monkeypatch.setattr("ballplate.extensions.sweeps.local.compute", vanishing)
    assert main(commands(store, "sweep")[0]) == 3
    out, err = capsys.readouterr()
    assert "done" not in out
    line = err.splitlines()[-1]
    assert (
        line.startswith(f"{store}: was deleted, moved or replaced ")
        and wording.WHILE_THE_SWEEP_RAN in line
        and "Traceback" not in err
    )
    if what == "replaced":
        assert store.read_bytes() == other
    if what == "moved":
        # With all rows that were computed before.
        assert rows(store.with_name("elsewhere.sqlite"))["cell"].tolist() == [0, 1]


def test_another_process_that_writes_is_told(
    store: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(store_file, "PATIENCE", 0.2)
    connection = sqlite3.connect(store, isolation_level=None)
    connection.execute("PRAGMA locking_mode = EXCLUSIVE")
    connection.execute("BEGIN EXCLUSIVE")
    try:
        for arguments in commands(store):
            assert main(arguments) == 3
            err = capsys.readouterr().err
            assert err == f"{store}: another process is writing to it; wait for it, or end it\n"
    finally:
        connection.close()


def test_what_a_killed_sweep_left_in_its_log_is_read(store: Path, tmp_path: Path) -> None:
    """Rows are in the write-ahead log until SQLite moves them."""
    right = rows(store)
    open_one = open_store(store, create=True)
    with open_one.connection as connection:
        connection.execute("UPDATE result SET seconds = 17")
    (tmp_path / "killed").mkdir()
    for path in tmp_path.glob("small.sqlite*"):
        shutil.copy(path, tmp_path / "killed")
    open_one.close()
    copy = tmp_path / "killed/small.sqlite"
    assert (tmp_path / "killed/small.sqlite-wal").stat().st_size > 0
    found = open_store(copy)
    assert all(row.seconds == 17 for row in results(found, 1, 4).rows)
    found.close()
    assert_same(rows(copy), right)


@pytest.mark.parametrize("log", [b"", b"x" * 10_000, b"\x37\x7f\x06\x82" + bytes(5000)])
def test_a_log_of_something_else_is_left_out(log: bytes, store: Path) -> None:
    right = rows(store)
    store.with_name("small.sqlite-wal").write_bytes(log)
    assert_same(rows(store), right)


def test_a_folder_that_cannot_be_written() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o555)
        is_root = os.geteuid() == 0
        if is_root:
            # Nothing is forbidden to root.
            os.seteuid(65534)
        try:
            with pytest.raises(StoreError, match=wording.ITS_FOLDER_CANNOT_BE_WRITTEN):
                open_store(folder / "s.sqlite", create=True)
        finally:
            if is_root:
                os.seteuid(0)
        assert not list(folder.iterdir())


HOSTILE = "\x1b[31m\x07<script>alert(1)</script>::error::\u202eevil"


def test_text_of_a_store_is_escaped(store: Path, capsys: pytest.CaptureFixture[str]) -> None:
    by_sql(
        f"UPDATE result SET reason = '{HOSTILE}'",
        f"UPDATE sweep SET definition = replace(definition, 'many small cells', 'T {HOSTILE}')".replace(
            "\x1b", "\\u001b"
        ).replace("\x07", "\\u0007"),
        f"UPDATE text SET value = '{{\"ballplate\": \"{HOSTILE}\"}}' WHERE value LIKE '{{%'".replace(
            "\x1b", "\\u001b"
        ).replace("\x07", "\\u0007"),
    )(store)
    signed(store)
    for arguments in commands(store):
        assert main(arguments) in (0, 1)
        out, err = capsys.readouterr()
        assert "\x1b" not in out + err and "\x07" not in out + err and "\u202e" not in out + err
    assert main(["sweep", "--export", str(store), "-o", "-"]) == 0
    assert main(["sweep", "--report", str(store), "--format", "text"]) == 0
    out = capsys.readouterr().out
    assert "\x1b" not in out and "\\x1b" in out
    for path in store.parent.glob("report.*"):
        text = path.read_text(encoding="utf-8")
        assert "\x1b" not in text and "\u202e" not in text, path
    assert "<script" not in (store.parent / "report.html").read_text(encoding="utf-8")


def flipped(store: Path, chance: random.Random) -> None:
    """Change some bits somewhere."""
    content = bytearray(store.read_bytes())
    for _ in range(chance.choice([1, 1, 2, 8, 64])):
        # The header and the first page hold what SQLite believes most.
        end = chance.choice([100, 4096, len(content), len(content), len(content)])
        content[chance.randrange(min(end, len(content)))] ^= 1 << chance.randrange(8)
    if chance.random() < 0.15:
        del content[chance.randrange(len(content)) :]
    store.write_bytes(content)


def assert_survives(made: Path, folder: Path, seed: int, right: pandas.DataFrame) -> str:
    """Flip bits of a store: whatever is read of it is right, and everything else is told; the
    status by itself.
    """
    chance = random.Random(seed)
    store = folder / "small.sqlite"
    for path in folder.iterdir():
        path.unlink()
    for name in ("small.yaml", "quickstart.yaml", "small.sqlite"):
        shutil.copy(made / name, folder)
    flipped(store, chance)
    kind = chance.choice(["csv", "csv", "csv", "text", "sweep"])
    status = main(commands(store, kind)[0])
    assert status in ((1, 3) if kind == "sweep" else (0, 3)), seed
    table = folder / "table.csv"
    if table.exists():
        found = read_table(table)
        assert_subset(found, right)
        assert status == 3 or len(found) == 4, seed
    if kind == "sweep" and status == 1:
        assert_same(rows(store), right)
    return f"{kind} {status}"


def test_flipped_bits(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    right = rows(made / "small.sqlite")
    seen = {assert_survives(made, tmp_path, seed, right) for seed in range(40)}
    assert {"csv 0", "csv 3", "sweep 1", "sweep 3"} <= seen
    assert "Traceback" not in capsys.readouterr().err
