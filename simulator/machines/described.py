"""Settings that name a machine file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import PrivateAttr

from ..inputs.settings import Settings

if TYPE_CHECKING:
    from .description import MachineDescription


class OfMachineFile(Settings):
    """Settings of a machine that a file describes."""

    # What the file says; filled in when the experiment is loaded.
    _machine: MachineDescription | None = PrivateAttr(default=None)

    def of(self, machine: MachineDescription) -> None:
        """Take the machine that the file describes."""
        self._machine = machine

    @property
    def described(self) -> MachineDescription:
        """The machine that the file describes."""
        assert self._machine is not None
        return self._machine
