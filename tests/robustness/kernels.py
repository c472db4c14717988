"""Runs commands in one process and writes what they said, with the kernel that linear algebra used,
as JSON.
"""

from __future__ import annotations

import io
import json
import sys
from contextlib import redirect_stderr, redirect_stdout


def architectures() -> list[str]:
    """Processors that the OpenBLAS of NumPy and SciPy takes this one for; none of another
    library.
    """
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_info

    return sorted(
        {one["architecture"] for one in threadpool_info() if one["internal_api"] == "openblas"}
    )


def outcome(arguments: list[str]) -> tuple[int, str, str]:
    """Status, standard output and standard error of a command."""
    from ballplate.cli import main

    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        status = main(arguments)
    return status, out.getvalue(), err.getvalue()


if __name__ == "__main__":
    said = [outcome(arguments) for arguments in json.load(sys.stdin)]
    json.dump({"architectures": architectures(), "said": said}, sys.stdout)
