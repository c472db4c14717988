"""Versions of the numerical libraries."""

from __future__ import annotations

import importlib.metadata
import platform
from functools import cache


@cache
def versions() -> tuple[tuple[str, str], ...]:
    """Return pairs of a library and its version, BLAS with its architecture."""
    import numpy
    import numpy.linalg
    import scipy
    import scipy.linalg
    from threadpoolctl import threadpool_info

    blas = sorted(
        {
            f"{lib['internal_api']} {lib.get('version')} {lib.get('architecture', '')}".strip()
            for lib in threadpool_info()
            if lib["user_api"] == "blas"
        }
    )
    return (
        ("ballplate", importlib.metadata.version("ballplate")),
        ("python", platform.python_version()),
        ("numpy", numpy.__version__),
        ("scipy", scipy.__version__),
        ("blas", "; ".join(blas)),
    )
