"""What is printed where the terminal or the pipe has another encoding than UTF-8, as on Windows."""

from __future__ import annotations

import ast
import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from ballplate.cli import main

from tests.reference.copies import copy_tree

ROOT = Path(__file__).parents[2]
NAMES = ("open", "read_text", "write_text")
OPENED = r"^open$|(?<!^os)(?<!\barchive)\.\w+$"
BYTES = r"^'[rwxa+]*b[rwxa+]*'$"
TITLE = "Prüfkörper “A” – 0.5 µm ± 2 µm × 3, ≤ 20 °C …"
COMMANDS = [
    "run plate.yaml",
    "sweep --report sizes.sqlite --format text",
    "check --json plate.yaml",
    "check --format junit plate.yaml",
    "check --format github plate.yaml",
    "run --json plate.yaml",
    "simulate plate.yaml -o -",
    "fit --json plate.yaml readings.csv",
    "map machine.yaml --format csv",
    "map machine.yaml --json",
    "sweep --export sizes.sqlite -o -",
    "sweep --report sizes.sqlite --format markdown",
    "spline errors.csv -o -",
    "schema",
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An experiment, its readings, a machine and a sweep with names that not every encoding has."""
    top = tmp_path_factory.mktemp("encodings")
    lines = (ROOT / "designs/quickstart.yaml").read_text(encoding="utf-8").splitlines()
    text = "\n".join(f"title: '{TITLE}'" if line.startswith("title:") else line for line in lines)
    text = text.replace("z low", "µ ü").replace("_coefficients: 5", "_coefficients: 3")
    text = text.replace("balls: [5, 5]", "balls: [3, 3]")
    (top / "plate.yaml").write_text(text, encoding="utf-8")
    lines = (ROOT / "designs/park/machines/gec-like.yaml").read_text(encoding="utf-8").splitlines()
    text = "\n".join(f"title: '{TITLE}'" if line.startswith("title:") else line for line in lines)
    copy_tree(ROOT / "designs/park/machines", top, dirs_exist_ok=True)
    (top / "machine.yaml").write_text(text, encoding="utf-8")
    (top / "sizes.yaml").write_text(
        f"title: '{TITLE}'\nbase: plate.yaml\naxes: {{µ: {{paths: ['artefacts.plate.balls[0]',"
        " 'artefacts.plate.balls[1]'], values: [3, 4]}}\n",
        encoding="utf-8",
    )
    points = "\n".join(f"{10 * k},{k % 3}" for k in range(30))
    (top / "errors.csv").write_text(f"position_mm,error_um\n{points}\n", encoding="utf-8")
    before = Path.cwd()
    os.chdir(top)
    try:
        assert main(["simulate", "plate.yaml", "-o", "readings.csv"]) == 0
        assert main(["sweep", "sizes.yaml", "--workers", "1"]) == 0
    finally:
        os.chdir(before)
    return top


def printed(command: str, encoding: str, monkeypatch: pytest.MonkeyPatch) -> tuple[bytes, bytes]:
    """Standard output and standard error as bytes, of streams as Python opens them for a pipe."""
    out, err = io.BytesIO(), io.BytesIO()
    with monkeypatch.context() as patch:
        streams = [
            io.TextIOWrapper(out, encoding=encoding, errors="strict", write_through=True),
            io.TextIOWrapper(err, encoding=encoding, errors="backslashreplace", write_through=True),
        ]
        patch.setattr(sys, "stdout", streams[0])
        patch.setattr(sys, "stderr", streams[1])
        assert main(command.split()) == 0
        for stream in streams:
            stream.flush()
        return out.getvalue(), err.getvalue()


@pytest.mark.parametrize("command", COMMANDS)
def test_pipes_are_utf_8_whatever_the_encoding(
    command: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    whole = printed(command, "utf-8", monkeypatch)[0]
    assert whole.decode("utf-8")
    for encoding in ("ascii", "cp437", "cp1252", "utf-16") if command == "schema" else ("ascii",):
        assert printed(command, encoding, monkeypatch)[0] == whole
    if "--json" in command:
        data = json.loads(whole)
        assert "title" not in data or data["title"] == TITLE
    if "junit" in command:
        assert TITLE in ElementTree.tostring(ElementTree.fromstring(whole), "unicode")


@pytest.mark.skipif(
    not str(ROOT).isascii(), reason="in the locale C Python finds nothing installed in such a path"
)
def test_files_are_utf_8_with_line_feeds(
    folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Whatever the locale: with that of C and without Python's UTF-8 mode, files would be ASCII."""
    path = tmp_path / "µ.csv"
    command = ["-X", "utf8=0", "-m", "ballplate", "simulate", "plate.yaml", "-o", path]
    found = subprocess.run(
        [sys.executable, *command],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "LC_ALL": "C", "PYTHONCOERCECLOCALE": "0"},
        capture_output=True,
    )
    assert found.returncode == 0 and b"Traceback" not in found.stderr, found.stderr
    assert path.read_bytes().decode("utf-8").count("\n") > 10 and b"\r" not in path.read_bytes()
    assert "µ ü" in (tmp_path / "µ.csv").read_text(encoding="utf-8")


def opened(tree: ast.AST) -> list[ast.Call]:
    """Calls that open text files: open(), and the methods of paths, but those of the module os, of
    an archive, and of bytes.
    """
    calls = [one for one in ast.walk(tree) if isinstance(one, ast.Call)]
    names = [getattr(one.func, "attr", getattr(one.func, "id", "")) for one in calls]
    found = [one for one, name in zip(calls, names, strict=True) if name in NAMES]
    found = [one for one in found if re.search(OPENED, ast.unparse(one.func))]
    return [one for one in found if not any(re.search(BYTES, ast.unparse(a)) for a in one.args)]


def test_every_file_is_opened_with_an_encoding() -> None:
    """That of the system, which counts where none is stated, is another one on Windows."""
    assert len(opened(ast.parse("open(a)\na.open('rb')\na.read_text()\nos.open(a, 1)\n"))) == 2
    count = 0
    for package in ("analysis", "simulator"):
        for path in (ROOT / package).rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            # Parsing all files takes seconds.
            for call in opened(ast.parse(text)) if re.search(r"open\(|_text\(", text) else ():
                count += 1
                assert "encoding" in [one.arg for one in call.keywords], f"{path}:{call.lineno}"
    assert count >= 8
