"""A design that is judged when this is imported: so a process has loaded all that judging loads, and
copies of it begin at once.
"""

from __future__ import annotations

from pathlib import Path

from ballplate.designs import shipped

from .document import opened
from .judging import judgement

judgement(opened(Path(shipped("quickstart.yaml"))))
