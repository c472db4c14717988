"""`python -m ballplate`, the same as the command `ballplate`."""

import sys

from .cli import main

sys.exit(main())
