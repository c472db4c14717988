"""Settings of all tests of the studio."""

import pytest


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are waited for, however busy the machine is."""
    monkeypatch.setattr("ballplate.extensions.studio.session.PATIENCE", 120.0)
