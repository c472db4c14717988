"""Old names of commands, options and functions are refused with their successors."""

from __future__ import annotations

import ballplate as bp
import pytest
from ballplate.cli import commands_of_all, main
from ballplate.simulator.inputs.moved import MOVED


@pytest.mark.parametrize("old", MOVED)
def test_an_old_name_names_its_successor(old: str, capsys: pytest.CaptureFixture[str]) -> None:
    if old.startswith("bp."):
        with pytest.raises(AttributeError, match=MOVED[old]):
            getattr(bp, old.removeprefix("bp."))
        return
    _, command, *option = old.split()
    assert bool(option) == (command in commands_of_all())
    with pytest.raises(SystemExit) as ended:
        main([command, "a.yaml", "b.yaml", *option, *["c.csv"] * bool(option)])
    assert ended.value.code == 2
    assert capsys.readouterr().err.endswith(f" is now {MOVED[old]}\n")


@pytest.mark.parametrize("new", MOVED.values())
def test_a_successor_is_there(new: str) -> None:
    _, command, *_ = (*new.split(), "")
    name = new.split(", ")[0].removeprefix("ballplate ").removeprefix("bp.")
    words = [name, name.split()[0]]
    assert new == "-o" or hasattr(bp, name) or set(words) & set(commands_of_all()), command


def test_four_groups_have_twenty_commands_at_most() -> None:
    """Those that an option makes of another are in the help of that."""
    names = [name for name in commands_of_all() if " " not in name]
    more = {"compare", "schema", "spline", "reproduce"}
    assert len(set(names) - more) <= 20 and more <= set(names)
