"""Keys that name a machine file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import PrivateAttr

from ..inputs.settings import Settings

if TYPE_CHECKING:
    from .description import MachineDescription


class OfMachineFile(Settings):
    """A machine that a file describes."""

    # Content of the file; set when the experiment is loaded.
    _machine: MachineDescription | None = PrivateAttr(default=None)

    def set_machine(self, machine: MachineDescription) -> None:
        """Set the machine of the file."""
        self._machine = machine

    @property
    def described(self) -> MachineDescription:
        """The machine of the file."""
        assert self._machine is not None
        return self._machine
