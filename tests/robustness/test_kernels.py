"""What is told does not depend on the kernels of linear algebra, whose sums round in other orders.

OpenBLAS has kernels for many processors and takes those of the variable OPENBLAS_CORETYPE. Symmetrical designs are the
hard ones: whatever is equal but for rounding could be told in any order, and a null space in any basis.
"""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from .. import planning  # noqa: F401
