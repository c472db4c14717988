"""`python -m analysis.cli`, the same as the command `ballplate`."""

import sys

from . import main

sys.exit(main())
