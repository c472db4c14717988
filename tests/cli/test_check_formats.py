"""What `check` says to build servers, and the action and the hook that call it."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml
from ballplate.cli import main
from ballplate.extensions.ci.github import annotation_lines, in_message, in_property
from ballplate.extensions.ci.junit import junit_report
from ballplate.results.checked_files import CheckedFile
from ballplate.simulator.inputs.messages import Message

from tests.cli import wording

QUICKSTART = Path("designs/quickstart.yaml")
SYMMETRICAL = Path("designs/npl/6.1.1.yaml")
COMMAND = re.compile(r"::error file=(.*?)(?:,line=(\d+),col=(\d+))?,title=(.*?)::(.*)")


def run(*arguments: str | Path) -> int:
    return main([str(argument) for argument in arguments])


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """One good file, one with two wrong ranks, one that cannot be used, one that states no rank and
    lacks it.
    """
    good = QUICKSTART.read_text(encoding="utf-8")
    (tmp_path / "good.yaml").write_text(good, encoding="utf-8")
    symmetrical = SYMMETRICAL.read_text(encoding="utf-8").replace("deficiency: 2", "deficiency: 1")
    symmetrical = symmetrical.replace("random: 100", "random: 12").replace("[7, 7]", "[5, 5]")
    (tmp_path / "wrong.yaml").write_text(symmetrical, encoding="utf-8")
    (tmp_path / "broken.yaml").write_text(
        good.replace("0.2 um            #", "100 %             #"), encoding="utf-8"
    )
    without = re.sub(r"expected_rank_deficiency: .*\n", "", good)
    without = re.sub(r"  - {name: [xy] .*\n", "", without)
    (tmp_path / "silent.yaml").write_text(without, encoding="utf-8")
    shutil.copy("designs/certified/weak.yaml", tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)
    return tmp_path


def test_every_file_is_worked_through(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("check", "broken.yaml", "missing.yaml", "good.yaml") == 3
    out, err = capsys.readouterr()
    assert "full rank, as expected; 174 parameters" in out
    assert [line.partition(":")[0] for line in err.splitlines()] == ["broken.yaml", "missing.yaml"]
    assert run("check", "wrong.yaml", "good.yaml") == 1
    assert run("check", "wrong.yaml", "broken.yaml") == 3


def test_json_is_a_format(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for option in (["--json"], ["--format", "json"]):
        assert run("check", *option, "good.yaml") == 0
        assert json.loads(capsys.readouterr().out)["rank_deficiency"] == 0
        assert run("check", *option, "wrong.yaml", "broken.yaml") == 3
        out, err = capsys.readouterr()
        assert [one["as_expected"] for one in json.loads(out)] == [True, False, True, False]
        assert err.startswith("broken.yaml:10:18: machine.repeatability: ")
        assert run("check", *option, "broken.yaml") == 3
        assert capsys.readouterr().out == ""


def test_suggestions_are_the_same_in_every_format(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def told(*options: str, status: int = 1) -> str:
        assert run("check", "--variant", "B", *options, "wrong.yaml") == status
        return capsys.readouterr().out

    lines = told("--suggest").splitlines()
    repairs = [line for line in lines if line.startswith("repair ")]
    # What is told without suggestions stays as it is.
    assert repairs and [line for line in lines if line not in repairs] == told().splitlines()
    bad = json.loads(told("--json", "--suggest"))
    suggested = bad.pop("repairs")
    assert bad == json.loads(told("--json"))
    assert len(suggested) == sum("in the file: " not in line for line in repairs)
    assert all(one["rank_deficiency"] == 0 for one in suggested)
    escaped = told("--format", "github", "--suggest").replace("%25", "%")
    failure = ElementTree.fromstring(told("--format", "junit", "--suggest")).find(".//failure")
    for line in repairs:
        assert f"%0A{line}" in escaped
        assert failure is not None and f"\n{line}" in (failure.text or "")
    # A deficiency that is expected is no error, and repaired all the same.
    text = (folder / "wrong.yaml").read_text(encoding="utf-8")
    (folder / "wrong.yaml").write_text(text.replace("deficiency: 1", "deficiency: 2"), "utf-8")
    lines = told("--suggest", status=0).splitlines()
    assert [line for line in lines if line.startswith("repair ")] == repairs


def test_an_unknown_variant_is_an_error_in_every_format(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("text", "github", "junit", "json"):
        assert run("check", "--format", name, "--variant", "E", "wrong.yaml") == 3
        out, err = capsys.readouterr()
        assert "no variant" in out + err
        # The file that has it may be the one that cannot be used.
        assert run("check", "--format", name, "--variant", "E", "wrong.yaml", "broken.yaml") == 3
        out, err = capsys.readouterr()
        assert "no variant" not in out + err


def test_workflow_commands(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ["good.yaml", "wrong.yaml", "broken.yaml", "missing.yaml", "silent.yaml"]
    assert run("check", "--format", "github", *names) == 3
    out, err = capsys.readouterr()
    assert err == ""
    lines = out.splitlines()
    good = [line for line in lines if not COMMAND.fullmatch(line)]
    assert [line.split(": ")[2] for line in good] == ["good", "wrong[A]", "wrong[C]"]
    assert all(line.startswith("as expected: ") for line in good)
    bad = [match.groups() for match in map(COMMAND.fullmatch, lines) if match is not None]
    assert [one[:4] for one in bad if one[3] == "experiment file"] == [
        ("broken.yaml", "10", "18", "experiment file"),
        ("missing.yaml", None, None, "experiment file"),
    ]
    # Where what is expected is stated, or the positions that leave it.
    ranks = {one[3]: one for one in bad if one[3].startswith("rank of ")}
    assert set(ranks) == {"rank of wrong[B]", "rank of wrong[D]", "rank of silent"}
    for name, number, column, _, text in ranks.values():
        source = (folder / name).read_text(encoding="utf-8").splitlines()
        line = source[int(number) - 1]
        if name == "silent.yaml":
            assert line == "positions:" and column == "1"
            assert re.search("rank deficiency [0-9]+, expected full rank", text)
            continue
        assert line[int(column) - 1 :] == "1"
        assert source[int(number) - 2].strip().startswith("calibration:")
        assert ": rank deficiency 2, expected 1; " in text


def test_files_are_named_from_the_top_of_the_repository(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GITHUB_WORKSPACE", str(folder.parent))
    names = ["broken.yaml", folder / "missing.yaml", "../../elsewhere.yaml"]
    assert run("check", "--format", "github", *names) == 3
    lines = capsys.readouterr().out.splitlines()
    names = [match[1] for match in map(COMMAND.fullmatch, lines) if match is not None]
    assert names == [
        f"{folder.name}/broken.yaml",
        f"{folder.name}/missing.yaml",
        "../../elsewhere.yaml",
    ]


def test_escapes_of_workflow_commands() -> None:
    assert in_message("50 %\r\n%0A: a, b") == "50 %25\\x0d%0A%250A: a, b"
    assert in_property("a:b,c%\n") == "a%3Ab%2Cc%25%0A"
    message = Message("odd, name: 5 %.yaml", 3, 4, "title", "two\nlines, 5 %")
    (line,) = annotation_lines(CheckedFile("odd, name: 5 %.yaml", (), (message,)))
    assert (
        line == "::error file=odd%2C name%3A 5 %25.yaml,line=3,col=4,title=experiment file::"
        "odd, name: 5 %25.yaml:3:4: title: two\\x0alines, 5 %25"
    )


def test_junit_report(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("check", "--format", "junit", "good.yaml", "wrong.yaml", "broken.yaml") == 3
    out, err = capsys.readouterr()
    assert err == ""
    top = ElementTree.fromstring(out)
    assert top.tag == "testsuites"
    assert [top.get(key) for key in ("tests", "failures", "errors")] == ["6", "2", "1"]
    counts = [
        tuple(suite.get(key) for key in ("name", "tests", "failures", "errors")) for suite in top
    ]
    assert counts == [
        ("good.yaml", "1", "0", "0"), ("wrong.yaml", "4", "2", "0"), ("broken.yaml", "1", "0", "1")
    ]  # fmt: skip
    cases = {case.get("name"): case for case in top.iter("testcase")}
    assert list(cases) == ["good", *(f"wrong[{one}]" for one in "ABCD"), "experiment file"]
    error = cases["experiment file"].find("error")
    assert error is not None and "machine.repeatability" in (error.text or "")


@pytest.mark.parametrize(
    ("name", "options", "kinds"),
    [
        ("wrong.yaml", [], {"wrong[B]": "rank", "wrong[D]": "rank"}),
        ("good.yaml", ["--goal", "U6 average 1 um", "--goal", "U6 average 1 pm"], {"good": "goal"}),
        ("weak.yaml", [], {}),
        ("weak.yaml", ["--fail-weak"], {"weak": "goal"}),
    ],
)
def test_reports_say_what_the_text_says(
    name: str,
    options: list[str],
    kinds: dict[str, str],
    folder: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def told(form: str) -> str:
        assert run("check", "--format", form, *options, name) == bool(kinds)
        return capsys.readouterr().out

    blocks = re.split(rf"^(?={name[:4]}\S*: )", told("text"), flags=re.MULTILINE)[1:]
    lines = told("github").splitlines()
    cases = list(ElementTree.fromstring(told("junit")).iter("testcase"))
    assert len(blocks) == len(lines) == len(cases) >= len(kinds)
    for block, line, case in zip(map(str.splitlines, blocks), lines, cases, strict=True):
        label = block[0].partition(": ")[0]
        assert (case.get("name"), case.get("classname")) == (label, name)
        assumed = [one for one in block if one.startswith(("assumed: ", "warning: "))]
        if label not in kinds:
            assert line == f"as expected: {name}: {label}: {'; '.join([block[1], *assumed])}"
            (told_there,) = case
            assert (told_there.tag, (told_there.text or "").splitlines()) == ("system-out", block)
            continue
        error = COMMAND.fullmatch(line)
        assert error is not None
        file, number, column, title, message = error.groups()
        place = f"{file}:{number}:{column}"
        assert title == f"{'goals' if kinds[label] == 'goal' else 'rank'} of {label}"
        assert message.replace("%0A", "\n").replace("%25", "%").splitlines() == [
            f"{place}: {label}: {block[1]}",
            *block[2:],
        ]
        (failure,) = case
        assert failure.tag == "failure" and failure.get("type") == kinds[label]
        assert (failure.text or "").splitlines() == [place, *block]
        missed = [one for one in block if one.startswith("goal not met")] or [block[1]]
        if options == ["--fail-weak"]:
            missed = ["1 weakly determined direction"]
        assert failure.get("message") == "; ".join([*missed, *assumed])


def test_a_junit_report_is_well_formed_for_any_text() -> None:
    odd = "".join(map(chr, range(0x20))) + "\x7f\ud800\udcff\ufffe\uffff<&\"'>]]>\U0001f600µ"
    message = Message(f"{odd}.yaml", 1, 2, odd, odd)
    report = junit_report([CheckedFile(f"{odd}.yaml", (), (message, message))])
    assert report.isascii()
    (suite,) = ElementTree.fromstring(report)
    kept = "\t\n\r\x7f<&\"'>]]>\U0001f600µ"
    assert suite.get("name") == f" {kept}.yaml".replace(" ", "", 1)
    error = suite.find("testcase/error")
    # A message is one line already; what XML does not have is left out.
    told = str(message).replace("\ufffe", "").replace("\uffff", "")
    assert error is not None and error.get("message") == told
    assert junit_report([])


def described(name: str) -> Any:
    return yaml.safe_load(Path(name).read_text(encoding="utf-8"))


def shell(script: str, folder: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a script as GitHub's shell `bash` does, with the command of this source tree."""
    tools = folder / "tools"
    tools.mkdir(exist_ok=True)
    for name, call in (("python", ""), ("ballplate", " -I -m ballplate")):
        program = tools / name
        if program.exists():
            continue
        program.write_text(f'#!/bin/sh\nexec "{sys.executable}"{call} "$@"\n', encoding="utf-8")
        program.chmod(0o755)
    return subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script],
        cwd=folder,
        env={
            **os.environ,
            "PATH": f"{tools}:{os.environ['PATH']}",
            "GITHUB_WORKSPACE": str(folder),
            **variables,
        },
        capture_output=True,
        text=True,
    )


def a_repository(top: Path) -> None:
    """Designs in folders, one of them with a blank in its name, beside YAML files that are none."""
    texts = dict.fromkeys(
        ("designs/one.yaml", "designs/more/of them.yaml"), QUICKSTART.read_text(encoding="utf-8")
    )
    texts |= {
        "settings.yaml": "colour: blue\n",
        "designs/machines/bridge.yaml": "arrangement: MB1\n",
    }
    for name in ("designs/sweeps/size.yaml", "designs/old/sweeps/size.yaml"):
        texts[name] = "base: ../one.yaml\n"
    for name, text in texts.items():
        (top / name).parent.mkdir(parents=True, exist_ok=True)
        (top / name).write_text(text, encoding="utf-8")


def test_the_action_checks(tmp_path: Path) -> None:
    action = described("action.yml")
    assert action["runs"]["using"] == "composite"
    *_, check = action["runs"]["steps"]
    assert check["shell"] == "bash" and check["env"] == {
        "FILES": "${{ inputs.files }}",
        "GOALS": "${{ inputs.goals }}",
        "FAIL_WEAK": "${{ inputs.fail-weak }}",
        "MODULES": "${{ inputs.modules }}",
    }
    a_repository(tmp_path)
    found = shell(check["run"], tmp_path, FILES=action["inputs"]["files"]["default"])
    assert (found.returncode, found.stderr) == (0, "")
    assert [line.split(": ")[1] for line in found.stdout.splitlines()] == [
        "designs/more/of them.yaml",
        "designs/one.yaml",
    ]
    # Each line is a goal; the second one is missed.
    goals = "U6 average 1 um\nU6 average 1 pm\n"
    found = shell(check["run"], tmp_path, FILES="designs/one.yaml", GOALS=goals, FAIL_WEAK="true")
    assert found.returncode == 1 and re.search(
        "goal met, given .*: average U6 at most 1 µm", found.stdout
    )
    assert (
        found.stdout.startswith("::error file=designs/one.yaml")
        and wording.GOAL_NOT_MET in found.stdout
    )
    (tmp_path / "designs/one.yaml").write_text("title: nothing else\n", encoding="utf-8")
    found = shell(check["run"], tmp_path, FILES="designs/o*.yaml\ndesigns/more/of them.yaml\n")
    assert found.returncode == 3
    lines = found.stdout.splitlines()
    assert lines[-1].startswith("as expected: designs/more/of them.yaml")
    assert len(lines) > 1 and all(
        line.startswith("::error file=designs/one.yaml,line=1,") for line in lines[:-1]
    )
    # Another word than true and false is refused, not taken for false.
    for name in ("FAIL_WEAK", "MODULES"):
        found = shell(check["run"], tmp_path, FILES="designs/more/of them.yaml", **{name: "yes"})
        assert found.returncode == 2 and "is true or false, not yes" in found.stdout
    # A pattern that nothing matches is no success, and what an input contains is never run.
    found = shell(check["run"], tmp_path, FILES="nothing/*.yaml\n$(touch intruder)")
    assert found.returncode == 3 and "nothing/*.yaml" in found.stdout
    assert not (tmp_path / "intruder").exists()


def test_the_action_installs(tmp_path: Path) -> None:
    """Nothing is fetched here: the command is run with a Python that only writes down what it is
    told.
    """
    action = described("action.yml")
    _, install, _ = action["runs"]["steps"]
    assert install["env"] == {"INSTALL": "${{ inputs.install }}"}
    recorder = tmp_path / "tools" / "python"
    recorder.parent.mkdir()
    recorder.write_text('#!/bin/sh\nprintf "%s\\n" "$@"\n', encoding="utf-8")
    recorder.chmod(0o755)
    for chosen, expected in (
        (action["inputs"]["install"]["default"], "/actions/ballplate"),
        ("ballplate==0.1", None),
    ):
        found = shell(
            install["run"], tmp_path, INSTALL=chosen, GITHUB_ACTION_PATH="/actions/ballplate"
        )
        assert found.stdout.splitlines() == [
            *("-I", "-m", "pip", "install", "--quiet"),
            expected or chosen,
        ]


def test_the_hook(tmp_path: Path) -> None:
    (hook,) = described(".pre-commit-hooks.yaml")
    assert (hook["id"], hook["language"], hook["types"]) == ("ballplate-check", "python", ["yaml"])
    a_repository(tmp_path)
    every = sorted(path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.yaml"))
    chosen = [
        name
        for name in every
        if re.search(hook["files"], name) and not re.search(hook["exclude"], name)
    ]
    assert chosen == ["designs/more/of them.yaml", "designs/one.yaml"]
    script = f'{hook["entry"]} "$@"'
    quoted = f"set -- {' '.join(json.dumps(name) for name in chosen)}; {script}"
    found = shell(quoted, tmp_path)
    assert found.returncode == 0 and found.stdout.count("full rank, as expected") == 2
    (tmp_path / "designs/one.yaml").write_text("title: nothing else\n", encoding="utf-8")
    assert shell(quoted, tmp_path).returncode == 3
