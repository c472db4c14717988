"""Commands, options and values that are mistyped: what was probably meant is told."""

from __future__ import annotations

from pathlib import Path
from random import Random

import ballplate as bp
import pytest
from ballplate.cli import main

from tests.cli import wording
from tests.cli.walk import commands


def complaint(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The last line of what is told of wrong usage."""
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    out, err = capsys.readouterr()
    assert out == ""
    return str(err.splitlines()[-1])


def swapped(word: str, random: Random) -> str:
    """A word with two letters in its middle exchanged that are not the same."""
    places = [
        k for k in range(1, len(word) - 1) if word[k] != word[k + 1] and "-" not in word[k : k + 2]
    ]
    k = random.choice(places)
    return word[:k] + word[k + 1] + word[k] + word[k + 2 :]


@pytest.mark.parametrize("command", ["check", "validate", "simulate", "plan"])
def test_a_mistyped_command(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    for number in range(3):
        word = swapped(command, Random(number))
        assert complaint(capsys, word, "x.yaml").endswith(
            f'invalid choice: {word!r}; did you mean "{command}"?'
        )


def test_a_word_that_is_no_command_is_told_all_of_them(capsys: pytest.CaptureFixture[str]) -> None:
    told = complaint(capsys, "xyzzy")
    assert "did you mean" not in told and all(
        command in told for command in commands() if " " not in command
    )


def test_every_option_mistyped(capsys: pytest.CaptureFixture[str]) -> None:
    tried = 0
    for name, command in commands().items():
        needed = [
            "x.yaml"
            for one in command._actions
            if not one.option_strings and one.choices is None
            for _ in range(one.nargs if isinstance(one.nargs, int) else 1)
        ]
        needed += ["npl"] if name == "reproduce" else []
        for option in command._option_string_actions:
            # Its own seed, so that another option changes nothing here.
            mistyped = swapped(option, Random(option)) if len(option) > 7 else "--"
            if any(known.startswith(mistyped) for known in command._option_string_actions):
                continue
            needs = [
                text
                for one in command._actions
                if one.required and one.option_strings
                for text in (one.option_strings[-1], *(one.choices or ["x"])[:1])
            ]
            told = complaint(capsys, name, *needed, *needs, mistyped)
            assert (
                told == f"ballplate {name}: error: unrecognized arguments: {mistyped}; did you mean"
                f' "{option}"?'
            )
            tried += 1
    assert tried > 50


def test_a_value_with_an_option_that_is_unknown(capsys: pytest.CaptureFixture[str]) -> None:
    assert complaint(capsys, "run", "x.yaml", "--trails=5").endswith(wording.DID_YOU_MEAN_3)
    assert complaint(capsys, "run", "x.yaml", "--zzzzzzz").endswith(
        "unrecognized arguments: --zzzzzzz"
    )


def test_a_mistyped_choice(capsys: pytest.CaptureFixture[str]) -> None:
    told = complaint(capsys, "check", "x.yaml", "--format", "juint")
    assert told.endswith(wording.ARGUMENT_FORMAT_INVALID_CHOICE)


def test_files_in_each_others_place_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Readings before the experiment, and maps in the place of readings."""
    design = "designs/quickstart.yaml"
    for arguments, words in (
        (["next", "readings.csv", design], f"first, then the readings: next {design} readings.csv"),
        (["run", "--budget", "readings.csv", design], "the experiment file comes first"),
        (["fit", design, "map.yml"], "map.yml is no table of readings"),
        (["next", design, "map.yaml"], "map.yaml is no table of readings"),
        (["diff", "map.yaml", "r.csv"], "r.csv:1:1: is no map file"),
    ):
        if "diff" in arguments:
            readings = bp.simulate(bp.quickstart())
            readings.to_csv(tmp_path / "r.csv", index=False)
            fit = bp.fit(bp.quickstart(), readings)
            bp.write_map(fit.to_map(), tmp_path / "map.yaml")  # type: ignore[attr-defined]
            files = ("map.yaml", "r.csv")
            arguments = [str(tmp_path / one) if one in files else one for one in arguments]
        # A table in the place of a map is refused as a file, with its line.
        assert main(arguments) == (3 if "diff" in arguments else 2), arguments
        assert words in capsys.readouterr().err
