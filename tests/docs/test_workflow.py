"""The workflow that tests on every system: it is one that GitHub takes, and runs what the README
says.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

WORKFLOW = Path(".github/workflows/tests.yml")
WORKFLOWS = sorted(WORKFLOW.parent.glob("*.yml"))
README = Path("README.md").read_text(encoding="utf-8")
STEPS = [
    step
    for job in yaml.safe_load(WORKFLOW.read_text(encoding="utf-8"))["jobs"].values()
    for step in job["steps"]
]


def command(name: str) -> str:
    """A command of the README, by the comment above it."""
    match = re.search(rf"<!-- {name} -->\n```sh\n(.*)\n```", README)
    assert match is not None
    return match[1]


@pytest.mark.parametrize(
    ("schema", "files", "right", "wrong"),
    [
        ("vendor.github-workflows", WORKFLOWS, "runs-on:", "run-on:"),
        ("custom.github-workflows-require-timeout", WORKFLOWS, "timeout-minutes:", "name:"),
        ("vendor.github-actions", [Path("action.yml")], "using:", "usign:"),
    ],
)
def test_a_linter_finds_nothing(
    schema: str, files: list[Path], right: str, wrong: str, tmp_path: Path
) -> None:
    def linted(*paths: Path) -> int:
        lint = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", schema]
        return subprocess.run([*lint, *map(str, paths)], capture_output=True).returncode

    assert linted(*files) == 0
    changed = tmp_path / "wrong.yml"
    changed.write_text(files[0].read_text("utf-8").replace(right, wrong), encoding="utf-8")
    assert linted(changed) == 1


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_it_may_do_little_and_uses_what_cannot_change(path: Path) -> None:
    workflow: Any = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert workflow["permissions"] == {
        "contents": "read"
    } and "pull_request_target" not in path.read_text("utf-8")
    steps = [step for job in workflow["jobs"].values() for step in job["steps"]]
    used = [step["uses"] for step in steps if "uses" in step]
    assert used and all(re.fullmatch(r"actions/[a-z-]+@[0-9a-f]{40}", one) for one in used)
    # Only what a tag starts writes anything.
    writing = [name for name, job in workflow["jobs"].items() if "permissions" in job]
    assert all(workflow["jobs"][name]["if"] == "github.ref_type == 'tag'" for name in writing)
    assert writing == (["publish"] if path.stem == "release" else [])
    # Nothing that somebody else chooses, such as the name of a branch, gets into a script.
    assert not any("${{" in step.get("run", "") for step in steps)


def test_the_release_has_one_version() -> None:
    version = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"][
        "version"
    ]
    cited = yaml.safe_load(Path("CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == version
    changes = Path("CHANGELOG.md").read_text(encoding="utf-8")
    assert f"## {version} ({cited['date-released']})" in changes
    assert len(changes.splitlines()) < 70
    # Fragments are named so that they are collected.
    kinds = "added|changed|removed|fixed"
    for path in Path("changes").iterdir():
        assert path.name == "README.md" or re.fullmatch(rf"[\w-]+\.({kinds})\.md", path.name)


def test_it_runs_the_commands_of_the_readme() -> None:
    scripts = [step["run"].strip() for step in STEPS if "run" in step]
    on_windows = (
        command("test command").replace("/bin/", "/Scripts/").replace("python3 ", "python ")
    )
    with_browser = scripts.pop(2).splitlines()
    assert scripts.pop().endswith("pytest -m long tests/docs")
    assert scripts == [".ci/run", "\n".join(on_windows.split(" && ")), command("oldest versions")]
    contributing = Path("CONTRIBUTING.md").read_text(encoding="utf-8")
    assert with_browser[0] == "python -m venv .venv"
    documented = [line.partition("   #")[0].strip() for line in contributing.splitlines()]
    assert set(with_browser[1:]) <= set(documented)


def test_every_dependency_states_the_oldest_version_tried() -> None:
    project = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    stated = [*project["dependencies"], *(one for name in extras for one in extras[name])]
    assert all(
        re.fullmatch(r"[A-Za-z0-9-]+>=[0-9.]+|ballplate\[[a-z,]+\]", one) for one in stated
    ), stated
    # What the tests take along is what the command above installs: all but what only benchmarks,
    # tests in a browser and releases need.
    tried = {
        "test",
        *re.findall(
            r"\w+", next(one for one in extras["test"] if one.startswith("ballplate["))[9:]
        ),
    }
    tried |= {
        name
        for one in extras["docs"]
        if one.startswith("ballplate[")
        for name in re.findall(r"\w+", one[9:])
    }
    assert set(extras) - tried == {"benchmark", "browser", "release"}
    assert "3.11" in project["requires-python"] and command("oldest versions").startswith(
        "python3.11 "
    )
