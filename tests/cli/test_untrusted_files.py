"""Files from a change that somebody proposes: no module is run, and no name is read as a
command.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from ballplate.cli import main

from tests.cli import wording
from tests.cli.test_check_formats import described, shell
from tests.cli.walk import small_file

QUICKSTART = Path(__file__).parents[2] / "designs" / "quickstart.yaml"
MODEL = """\
from pathlib import Path

Path("intruder").touch()


def build(lower, upper):
    raise ValueError("no model")
"""
PYTHON = "{kind: python, object: 'mine:build'}"
# Where an experiment file can have an error model in Python.
PLACES = {
    "error model": ("error_model:", f"error_model: {PYTHON}\nformer:"),
    "true machine": ("  seed: 7", f"  seed: 7\n  error_model: {PYTHON}"),
    "variant": ("# Offsets", f"variants: {{one: {{}}, two: {{error_model: {PYTHON}}}}}\n# Offsets"),
    "key of a variant": (
        "error_model:",
        "variants: {one: {}, two: {error_model.object: 'mine:build'}}\n"
        "error_model: {kind: python, object: 'gone:build'}\nformer:",
    ),
}


def written(folder: Path, place: str) -> Path:
    text = QUICKSTART.read_text(encoding="utf-8")
    old, new = PLACES[place]
    assert old in text
    path = folder / "design.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    (folder / "mine.py").write_text(MODEL, encoding="utf-8")
    return path


@pytest.mark.parametrize("place", PLACES)
def test_modules_are_refused_before_they_are_run(
    place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, place)
    monkeypatch.chdir(tmp_path)
    assert main(["check", "--no-modules", str(path)]) == 3
    told = capsys.readouterr().err
    assert told.startswith(f"{path}:")
    assert wording.MODULES_ARE_NOT_ALLOWED_HERE_LEAVE in told
    assert not Path("intruder").exists()


def test_modules_are_run_where_they_are_allowed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path, "true machine")
    monkeypatch.chdir(tmp_path)
    assert main(["check", str(path)]) == 3
    assert Path("intruder").exists()


def test_the_hook_and_the_action_refuse_modules(tmp_path: Path) -> None:
    (hook,) = described(".pre-commit-hooks.yaml")
    assert hook["entry"] == "ballplate check --no-modules"
    written(tmp_path, "true machine")
    action = described("action.yml")
    run = action["runs"]["steps"][-1]["run"]
    found = shell(run, tmp_path, FILES="*.yaml", MODULES=action["inputs"]["modules"]["default"])
    assert found.returncode == 3 and wording.MODULES_ARE_NOT_ALLOWED_HERE in found.stdout
    assert not (tmp_path / "intruder").exists()
    assert shell(run, tmp_path, FILES="*.yaml", MODULES="true").returncode == 3
    assert (tmp_path / "intruder").exists()


def test_the_action_runs_no_module_of_the_change_that_it_checks(tmp_path: Path) -> None:
    pytest.importorskip("pip")
    hostile = ["pip", "ballplate", "yaml", "numpy", "argparse", "site"]
    hostile += ["sitecustomize", "usercustomize"]
    for name in hostile:
        (tmp_path / f"{name}.py").write_text(
            f"from pathlib import Path\nPath({str(tmp_path / 'intruder')!r}).touch()\n",
            encoding="utf-8",
        )
    (tmp_path / "design.yaml").write_text(QUICKSTART.read_text(encoding="utf-8"), encoding="utf-8")
    setup, install, check = described("action.yml")["runs"]["steps"]
    assert re.fullmatch(r"actions/setup-python@[0-9a-f]{40}", setup["uses"])
    found = shell(install["run"], tmp_path, INSTALL="--help")
    assert found.returncode == 0 and "pip install" in found.stdout
    found = shell(check["run"], tmp_path, FILES="*.yaml", MODULES="false")
    assert found.returncode == 0 and "full rank" in found.stdout
    assert not (tmp_path / "intruder").exists()


def test_patterns_are_expanded_without_a_shell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    names = ["a.yaml", "b/c.yaml", "b/d/e f.yaml", "b/[x].yaml", "sweeps/s.yaml"]
    names += ["b/machines/m.yaml"]
    for name in names:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        small_file(Path(name))

    def checked(*patterns: str, status: int = 0) -> list[str]:
        assert main(["check", "--format", "github", "--", *patterns]) == status
        return [
            line.split(": ")[1]
            for line in capsys.readouterr().out.splitlines()
            if line.startswith("as expected")
        ]

    assert checked("**/*.yaml") == ["a.yaml", "b/[x].yaml", "b/c.yaml", "b/d/e f.yaml"]
    assert checked("b/*.yaml", "b/c.yaml", "a.yaml") == ["b/[x].yaml", "b/c.yaml", "a.yaml"]
    assert checked("b/[x].yaml") == ["b/[x].yaml"]
    assert checked("sweeps/s.yaml") == ["sweeps/s.yaml"]
    # What matches nothing is an error, and the others are checked nevertheless.
    assert checked("nothing/*.yaml", "a.yaml", status=3) == ["a.yaml"]
    # A folder that a pattern names itself is meant, whatever it is called.
    assert checked("sweeps/*.yaml") == ["sweeps/s.yaml"]
    assert checked("*/*.yaml") == ["b/[x].yaml", "b/c.yaml"]


def test_names_of_files_are_no_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for k, name in enumerate(
        ("a\n::warning::b.yaml", "c\r::error::d.yaml", "\x1b[31m##[error]e.yaml")
    ):
        Path(name).mkdir()
        small_file(Path(name, "design.yaml"))
        small_file(Path(name, "wrong.yaml"), expected_rank_deficiency=1)
        Path(name, "broken.yaml").write_text("title: [", encoding="utf-8")
        files = [f"{name}/{one}.yaml" for one in ("design", "wrong", "broken")]
        assert main(["check", "--format", "github", *files]) == 3
        out = capsys.readouterr().out
        lines = out.split("\n")[:-1]
        assert len(lines) == 3, k
        assert "\r" not in out and "\x1b" not in out and "##[" not in lines[0]
        assert not any(line.startswith(("::warning", "::error::")) for line in lines)
        # A report is printed on the log of a server that reads commands in it.
        assert main(["check", "--format", "junit", *files]) == 3
        lines = capsys.readouterr().out.splitlines()
        assert not any(line.startswith("::") for line in lines)
        assert any("[31m" in line or "\\x0" in line for line in lines)


@pytest.mark.parametrize(
    "arguments",
    [
        ["\x1b[31m"],
        ["check", "a.yaml", "--\x1b[31m"],
        ["schema", "\x1b[31m"],
        ["plan", "a.yaml", "--hours", "\x1b[31m\n::"],
    ],
)
def test_wrong_usage_is_told_without_control_characters(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    told = capsys.readouterr().err.splitlines()[-1]
    assert "x1b[31m" in told and told.isprintable()


def test_what_is_written_is_told_without_control_characters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """An experiment, readings, fewer of them, and a store, all under such a name."""
    monkeypatch.chdir(tmp_path)
    name = "\x1b[31m\n::error::"
    lines = [["init", f"{name}.yaml"], ["simulate", f"{name}.yaml", "-o", f"{name}.csv"]]
    lines += [
        ["fit", f"{name}.yaml", f"{name}.csv"],
        ["sweep", "sweep.yaml", "--workers", "1", "--store", f"{name}.sqlite"],
    ]
    for line in lines:
        if line[0] == "fit":
            readings = Path(line[2]).read_text().splitlines(keepends=True)
            Path(line[2]).write_text("".join(readings[:-1]))
        if line[0] == "sweep":
            axis = "axes: {seed: {path: seed, values: [1]}}"
            Path(f"{name}.yaml").rename("base.yaml")
            Path(line[1]).write_text(f"title: a\nbase: base.yaml\n{axis}\n")
        assert main(line) == 0
        out, err = capsys.readouterr()
        told = [text for text in (out + err).splitlines() if "[31m" in text]
        assert told and all(text.isprintable() for text in told), line
