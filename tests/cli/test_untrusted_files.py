"""Files from a change that somebody proposes: no module is run, and no name is read as a command."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.cli import main

from tests.cli.test_check_formats import described, shell

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
    "key of a variant": ("# Offsets", "variants: {one: {}, two: {error_model.kind: python}}\n# Offsets"),
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
    assert "modules are not allowed here" in told
    assert not Path("intruder").exists()


def test_modules_are_run_where_they_are_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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
    assert found.returncode == 3 and "modules are not allowed here" in found.stdout
    assert not (tmp_path / "intruder").exists()
    assert shell(run, tmp_path, FILES="*.yaml", MODULES="true").returncode == 3
    assert (tmp_path / "intruder").exists()


def test_patterns_are_expanded_without_a_shell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    names = ["a.yaml", "b/c.yaml", "b/d/e f.yaml", "b/[x].yaml", "sweeps/s.yaml", "b/machines/m.yaml"]
    for name in names:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text(QUICKSTART.read_text(encoding="utf-8"), encoding="utf-8")

    def checked(*patterns: str, status: int = 0) -> list[str]:
        assert main(["check", "--format", "github", "--", *patterns]) == status
        return [line.split(": ")[1] for line in capsys.readouterr().out.splitlines() if line.startswith("as expected")]

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
    text = QUICKSTART.read_text(encoding="utf-8")
    wrong = text.replace("expected_rank_deficiency: 0", "expected_rank_deficiency: 1")
    for k, name in enumerate(("a\n::warning::b.yaml", "c\r::error::d.yaml", "\x1b[31m##[error]e.yaml")):
        Path(name).mkdir()
        Path(name, "design.yaml").write_text(text, encoding="utf-8")
        Path(name, "wrong.yaml").write_text(wrong, encoding="utf-8")
        Path(name, "broken.yaml").write_text("title: [", encoding="utf-8")
        assert (
            main(["check", "--format", "github", *(f"{name}/{one}.yaml" for one in ("design", "wrong", "broken"))]) == 3
        )
        out = capsys.readouterr().out
        lines = out.split("\n")[:-1]
        assert len(lines) == 3, k
        assert "\r" not in out and "\x1b" not in out and "##[" not in lines[0]
        assert not any(line.startswith(("::warning", "::error::")) for line in lines)
