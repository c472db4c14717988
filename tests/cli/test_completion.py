"""Completion in bash, by a script that ballplate prints."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from ballplate.cli import _parsers, main, outputs

from tests.cli.walk import commands

needs_bash = pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")


def printed(capsys: pytest.CaptureFixture[str], shell: str) -> str:
    with pytest.raises(SystemExit) as left:
        main(["--print-completion", shell])
    assert left.value.code in (None, 0)
    out, err = capsys.readouterr()
    assert err == ""
    return out


def completed(script: str, folder: Path, *words: str) -> set[str]:
    """What bash offers for the last of the words."""
    (folder / "_parsers.bash").write_text(script, encoding="utf-8")
    code = (
        'source _parsers.bash; COMP_WORDS=(ballplate "$@"); COMP_CWORD=$#;'
        ' COMP_LINE="${COMP_WORDS[*]}"'
    )
    code += (
        '; COMP_POINT=${#COMP_LINE}; _shtab_ballplate ballplate "${@: -1}" ""; printf "%s\\n"'
        ' "${COMPREPLY[@]}"'
    )
    found = subprocess.run(
        ["bash", "-c", code, "bash", *words], cwd=folder, capture_output=True, text=True, timeout=60
    )
    return set(found.stdout.split())


@needs_bash
def test_commands_options_choices_and_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    script = printed(capsys, "bash")
    (tmp_path / "design.yaml").touch()
    (tmp_path / "folder").mkdir()
    every = {name for name in commands() if " " not in name}
    assert every <= completed(script, tmp_path, "")
    assert completed(script, tmp_path, "re") == {name for name in every if name.startswith("re")}
    for name in every:
        known = {
            option
            for other, command in commands().items()
            for option in command._option_string_actions
            if option.startswith("--") and other.split()[0] == name
        }
        assert completed(script, tmp_path, name, "--") == known, name
    assert completed(script, tmp_path, "check", "--format", "j") == {"junit", "json"}
    assert "design.yaml" in completed(script, tmp_path, "check", "des")
    assert "design.yaml" in completed(script, tmp_path, "plan", "x.yaml", "--sheet", "des")


@pytest.mark.parametrize("shell", _parsers.SHELLS)
def test_each_shell_has_a_script_with_all_commands(
    shell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    script = printed(capsys, shell)
    words = {word.strip("-") for name in commands() for word in name.split()}
    assert all(word in script for word in words)


def test_what_is_missing_is_told(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outputs.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(SystemExit) as left:
        main(["--print-completion", "bash"])
    out, err = capsys.readouterr()
    assert left.value.code == 3 and out == ""
    assert (
        err == "ballplate: completion needs shtab; install it with: python -m pip install"
        " 'ballplate[completion]'\n"
    )
