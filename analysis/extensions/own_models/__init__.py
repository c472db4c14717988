"""Error models and certified functions of balls of the user's own, in Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs import lazily

# What other extensions build on.
if TYPE_CHECKING:
    from .custom import module_source
    from .python_model import PythonSettings
    from .python_values import PythonCalibration

__getattr__, __dir__ = lazily(__name__, __file__)
