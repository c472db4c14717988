"""Completion of command lines by the shell: a script that shtab makes of the parser."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from .outputs import Needed, OutputAction

SHELLS = ("bash", "zsh", "tcsh")
COMPLETION = Needed("completion needs", ("shtab",), "completion")
BAD_FILE = 3


class PrintCompletion(argparse.Action):
    """Prints the script for a shell, and leaves."""

    def __call__(
        self, parser: Any, namespace: object, values: object, option_string: object = None
    ) -> None:
        if COMPLETION.is_missing:
            print(f"ballplate: {COMPLETION.told}", file=sys.stderr)
            parser.exit(BAD_FILE)
        import shtab

        _join_other_commands(parser)
        for command in parser.commands.values():
            for action in command._actions:
                if action.metavar == "FOLDER":
                    action.complete = shtab.DIRECTORY
                elif action.type is Path or isinstance(action, OutputAction):
                    action.complete = shtab.FILE
        print(shtab.complete(parser, str(values)))
        parser.exit()


def _join_other_commands(parser: Any) -> None:
    """Offer the options of a command that an option makes of another with those of the other."""
    commands = parser.commands
    for name in [name for name in commands if " " in name]:
        base = commands[name.partition(" ")[0]]
        for action in commands.pop(name)._actions:
            if action.option_strings and not set(action.option_strings) & set(
                base._option_string_actions
            ):
                base._add_action(action)
