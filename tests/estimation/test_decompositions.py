"""Where LAPACK's first routine does not converge, a second one is used, wherever a matrix is decomposed."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ballplate.simulator.computing import numerics

NAMES = ("svd", "eigh", "eigvalsh", "lstsq", "pinv")
GENERATOR = np.random.default_rng(5)
WIDE, SQUARE = GENERATOR.standard_normal((4, 7)), GENERATOR.standard_normal((5, 5))
POOR = WIDE.T @ WIDE
STACK = GENERATOR.standard_normal((2, 3, 5, 4))
COVARIANCES = STACK @ STACK.swapaxes(-1, -2)


@pytest.fixture
def failures(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of NumPy's routines that were called, of which every one now fails."""
    called: list[str] = []

    def failing(name: str, right: Callable[..., Any]) -> Callable[..., Any]:
        def fail(matrix: Any, *more: Any, **named: Any) -> Any:
            # NumPy itself decomposes constant matrices, for nodes of quadrature.
            by = sys._getframe(1).f_globals["__name__"].partition(".")[0]
            if not np.size(matrix) or by == "numpy":
                return right(matrix, *more, **named)
            called.append(name)
            raise np.linalg.LinAlgError(f"{name} did not converge")

        return fail

    for name in NAMES:
        monkeypatch.setattr(np.linalg, name, failing(name, getattr(np.linalg, name)))
    return called


@pytest.mark.parametrize("matrix", [WIDE, WIDE.T, SQUARE, POOR, STACK])
@pytest.mark.parametrize("full", [True, False])
def test_singular_vectors(matrix: Any, full: bool, failures: list[str]) -> None:
    left, values, right = numerics.svd(matrix, full_matrices=full)
    k = values.shape[-1]
    made = (left[..., :k] * values[..., None, :]) @ right[..., :k, :]
    np.testing.assert_allclose(made, matrix, atol=1e-12)
    assert left.shape[-1] == (matrix.shape[-2] if full else k)
    np.testing.assert_allclose(
        left.swapaxes(-1, -2) @ left, np.eye(left.shape[-1]) + 0 * left[..., :1, :1], atol=1e-12
    )
    np.testing.assert_allclose(numerics.svd(matrix, compute_uv=False), values, atol=1e-12)
    assert "svd" in failures


@pytest.mark.parametrize("matrix", [POOR, COVARIANCES])
def test_eigenvectors(matrix: Any, failures: list[str]) -> None:
    values, vectors = numerics.eigh(matrix)
    np.testing.assert_allclose(matrix @ vectors, vectors * values[..., None, :], atol=1e-11)
    assert (np.diff(values) >= 0.0).all()
    np.testing.assert_allclose(numerics.eigvalsh(matrix), values, atol=1e-11)
    assert set(failures) == {"eigh", "eigvalsh"}


def test_shortest_solutions_of_a_deficient_matrix(failures: list[str]) -> None:
    solution, _, rank, _ = numerics.lstsq(POOR, POOR[:, :2])
    assert rank == 4
    # The shortest one has no part in the null space, of which the wide matrix spans the rest.
    span = np.linalg.qr(WIDE.T)[0]
    np.testing.assert_allclose(POOR @ solution, POOR[:, :2], atol=1e-11)
    np.testing.assert_allclose(span @ (span.T @ solution), solution, atol=1e-11)
    inverse = numerics.pinv(WIDE)
    np.testing.assert_allclose(WIDE @ inverse, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(numerics.pinv(POOR, rcond=1e-9) @ POOR, span @ span.T, atol=1e-9)
    assert {"lstsq", "pinv"} <= set(failures)


def test_what_no_routine_can_decompose_is_refused_as_before() -> None:
    for wrong in (np.nan, np.inf):
        with pytest.raises(np.linalg.LinAlgError):
            numerics.svd(np.full((3, 3), wrong))


def modules() -> Iterator[Path]:
    for top in ("simulator", "analysis"):
        yield from Path(top).rglob("*.py")


def test_no_module_uses_the_first_routine_alone() -> None:
    """Of NumPy's linear algebra others use what does not iterate; norms of matrices would."""
    allowed = {"norm", "qr", "inv", "solve", "cholesky", "det", "LinAlgError"}
    found = set()
    for path in modules():
        if path.name in ("numerics.py", "library_versions.py"):
            continue
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "linalg" in text else ():
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "np.linalg":
                found.add(node.attr)
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "np.linalg.norm":
                assert len(node.args) == 1, (path, node.lineno)
            assert not isinstance(node, ast.ImportFrom) or node.module != "numpy.linalg", path
    assert found <= allowed
