"""A design that is judged when this is imported, so that copies of a process that has imported it
have loaded all that judging needs.
"""

from __future__ import annotations

from pathlib import Path

from ballplate.designs import shipped

from .document import opened
from .judging import judgement

judgement(opened(Path(shipped("quickstart.yaml"))))
