"""Parsers of command lines, with the help of commands."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

from ballplate.simulator.inputs.extensions import (
    Command,
    UnusableError,
    module_with,
    names,
    provider,
    registered,
)

from .notes import add_telling
from .outputs import Needed, OutputAction

# Modules of this package, in the order of the help.
COMMANDS = {
    "init": Command("init", "write a commented experiment or machine file to start from", "plan"),
    "check": Command("check", "check whether designs determine all their parameters", "plan"),
    "run": Command("run", "predict the uncertainties U1 to U6 that a design will achieve", "plan"),
    "simulate": Command("simulate", "write synthetic readings of a design", "measure"),
    "fit": Command("fit", "estimate machine errors, balls and poses from readings", "evaluate"),
    "schema": Command("schema", "print the JSON Schema of experiment, sweep, machine or map files"),
}
# Groups of commands in the help, with their titles.
GROUPS = {
    "plan": "plan an experiment",
    "measure": "measure",
    "evaluate": "evaluate readings",
    "use": "use the machine's map",
    "more": "more",
}


def commands_of_all() -> tuple[str, ...]:
    """The commands of the kernel, then those of extensions."""
    return (*COMMANDS, *names("commands", with_registered=True))


def tell_of_extensions() -> None:
    """Say which extensions that are registered are not used."""
    for complaint in registered()[1]:
        print(f"warning: {complaint}", file=sys.stderr)


def module_of(name: str) -> ModuleType:
    """The module of a command.

    :raises KeyError: there is no such command.
    :raises UnusableError: the extension that has it is not installed, or cannot be used.
    """
    if name in COMMANDS:
        return import_module(f".{name}", __package__)
    module = module_with("commands", name)
    if lacking := [
        needed for needed in ("DESCRIPTION", "add_options", "run") if not hasattr(module, needed)
    ]:
        raise UnusableError(f"its module lacks {', '.join(lacking)}")
    return module


def command_of(name: str) -> Command | None:
    """Return the listing of a command, unless its extension is not installed.

    :raises KeyError: there is no such command.
    """
    if name in COMMANDS:
        return COMMANDS[name]
    extension = provider("commands", name)
    if extension is None:
        raise KeyError(name)
    return extension.commands[name] if extension.is_installed else None


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


def with_command(words: Sequence[str]) -> list[str]:
    """A command line whose first word is the command, with the option that makes it another one."""
    # Another command with options of its own, such as "run --errors", is a parser of its own.
    # Argparse knows no such thing: the option is taken out before, and its name joined to the
    # command.
    command, *arguments = words
    if command.startswith("-"):
        return list(words)
    until = arguments.index("--") if "--" in arguments else len(arguments)
    for name in names("commands"):
        first, _, option = name.partition(" ")
        if first == command and option and option in arguments[:until]:
            arguments.remove(option)
            return [name, *arguments]
    return list(words)


def parser(chosen: Sequence[str] | None = None, with_options: bool = True) -> _Parser:
    """Return the command line's grammar, with all commands or some, or with their listing only."""
    top = _Parser(
        prog="ballplate",
        description="Plan and evaluate ball-plate experiments for co-ordinate measuring machines.",
        epilog=(
            "Exit status: 0 as expected, 1 not as expected, 2 a usage error, 3 a file that cannot"
            " be used, 70 an internal error, 130 or 143 interrupted."
        ),
    )
    top.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    top.add_argument(
        "--print-completion",
        action=PrintCompletion,
        choices=SHELLS,
        help=(
            "print a script for a shell that completes commands, options, choices and file"
            " names, and exit"
        ),
    )
    commands = top.add_subparsers(
        title="commands", metavar="COMMAND", dest="command", required=True
    )
    if chosen is None:
        tell_of_extensions()
    for name in commands_of_all() if chosen is None else chosen:
        listed = command_of(name)
        if chosen is None and (listed is None or " " in name and not with_options):
            continue
        try:
            # Loaded only now: little is loaded when an interruption begins to be answered.
            module = module_of(name) if with_options else None
        except UnusableError as error:
            if chosen is not None:
                raise
            print(f"{top.prog}: command {name}: {error}", file=sys.stderr)
            continue
        assert listed is not None
        listing: dict[str, Any] = {} if " " in name else {"help": _plain(listed.help)}
        command = commands.add_parser(name, **listing)
        if listing:
            # What is printed for it, of which argparse knows no group.
            group = listed.group if listed.group in GROUPS else "more"
            vars(commands._choices_actions[-1])["group"] = group
        if module is not None:
            command.description = module.DESCRIPTION
            module.add_options(command)
            _add_other_commands(command, name)
            command.set_defaults(run=module.run)
            add_telling(command)
    return top


def _plain(text: str) -> str:
    """Return a line of help without format directives for argparse."""
    return text.replace("%", "%%")


def _add_other_commands(command: _Parser, name: str) -> None:
    """List the options that make another command of one."""
    other_commands = [
        other_command for other_command in names("commands") if other_command.startswith(f"{name} ")
    ]
    group = command.add_argument_group("another command, with options of its own")
    for other_command in other_commands:
        if listed := command_of(other_command):
            group.add_argument(
                other_command.removeprefix(f"{name} "),
                action=_InFull,
                nargs=0,
                help=_plain(listed.help),
            )


def grammar(word: str) -> _Parser:
    """The grammar that a command line needs that begins with a word."""
    # Most often one command is meant, and only its module is loaded. The listing of all needs no
    # options. A wrong word is answered with the names of all commands.
    is_command = word in COMMANDS or not word.startswith("-") and provider("commands", word)
    if is_command:
        return parser([word])
    return parser(with_options=word.startswith("-") and word not in ("-h", "--help", "--version"))


class _Parser(argparse.ArgumentParser):
    """Parser that reports wrong usage in one line, with the probable intention.

    The parsers of commands are of this class as well.
    """

    def __init__(self, **settings: Any) -> None:
        super().__init__(formatter_class=_Formatter, **settings)

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        options, unknown = self.parse_known_args(args, namespace)
        for word in unknown:
            # Of an extension that is not shipped.
            if provider("commands", command := f"{options.command} {word}"):
                remaining_words = [remaining for remaining in args[1:] if remaining != word]
                return parser([command]).parse_args([command, *remaining_words], namespace)
        if unknown:
            chosen = self.commands[options.command]
            chosen.error(f"unrecognized arguments: {' '.join(unknown)}{chosen.meant_by(unknown)}")
        return options

    @property
    def commands(self) -> dict[str, _Parser]:
        """The parsers of the commands, by name."""
        # Not by `next`, which a command of this package hides.
        (subparsers,) = (
            action for action in self._actions if isinstance(action, argparse._SubParsersAction)
        )
        choices: dict[str, _Parser] = subparsers.choices
        return choices

    def meant_by(self, unknown: Sequence[str]) -> str:
        """Return a suggestion of the options that the unknown ones are probably meant to be."""
        from ballplate.simulator.inputs.settings import nearest

        option_strings = [
            option
            for action in self._actions
            for option in action.option_strings
            if option.startswith("--")
        ]
        meant = [
            nearest(option.partition("=")[0], option_strings)
            for option in unknown
            if option.startswith("--")
        ]
        suggestions = ", ".join(
            f'"{option}"' for option in dict.fromkeys(meant) if option is not None
        )
        return f"; did you mean {suggestions}?" if suggestions else ""

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            from ballplate.simulator.inputs.settings import nearest

            meant = nearest(str(value), [str(choice) for choice in action.choices])
            if meant is not None:
                raise argparse.ArgumentError(
                    action, f'invalid choice: {value!r}; did you mean "{meant}"?'
                )
        super()._check_value(action, value)

    def error(self, message: str) -> NoReturn:
        from ballplate.simulator.inputs.messages import in_one_line

        super().error(in_one_line(message))


class _Formatter(argparse.HelpFormatter):
    """Shows arguments that may be left out in brackets, positional ones too, and commands in
    groups.
    """

    def _format_action(self, action: argparse.Action) -> str:
        if not isinstance(action, argparse._SubParsersAction):
            return super()._format_action(action)
        parts = []
        for group, title in GROUPS.items():
            rows = [
                choice_action
                for choice_action in action._choices_actions
                if vars(choice_action).get("group") == group
            ]
            if rows:
                parts += [f"\n {title}\n", *map(self._format_action, rows)]
        return "".join(parts).removeprefix("\n")

    def _format_args(self, action: argparse.Action, default_metavar: str) -> str:
        if action.nargs == "+" and not action.option_strings and not action.required:
            return f"[{action.metavar} ...]"
        return super()._format_args(action, default_metavar)


class _InFull(argparse.Action):
    """An option that selects another command; it must be spelt in full."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        parser.error(f"write {self.option_strings[0]} in full")


class _Version(argparse.Action):
    """Prints the version, read only on request."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib.metadata import version

        print(f"ballplate {version('ballplate')}")
        parser.exit()
