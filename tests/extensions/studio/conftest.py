"""Settings of all tests of the studio, designs, and one browser and studio for those of a file."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from ballplate.designs import shipped
from ballplate.extensions.studio.document import DesignDocument, opened

from tests.extensions.studio.small import SMALL


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are waited for, however busy the machine is."""
    monkeypatch.setattr("ballplate.extensions.studio.session.PATIENCE", 120.0)


@pytest.fixture
def design(tmp_path: Path) -> Path:
    path = tmp_path / "plate.yaml"
    path.write_bytes(Path(shipped("quickstart.yaml")).read_bytes())
    return path


@pytest.fixture
def document(tmp_path: Path) -> DesignDocument:
    """The small quickstart as it is opened."""
    path = tmp_path / "plate.yaml"
    path.write_text(SMALL, encoding="utf-8")
    return opened(path)


@pytest.fixture
def session(design: Path) -> Iterator:
    from ballplate.extensions.studio.session import Session

    found = Session(design)
    yield found
    found.close()


@pytest.fixture(scope="module")
def browser() -> Iterator:
    from tests.extensions.pages.browser import chrome

    with chrome() as found:
        yield found


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Iterator:
    from tests.extensions.studio.chromium import Studio

    path = tmp_path_factory.mktemp("studio") / "plate.yaml"
    path.write_text(SMALL, encoding="utf-8")
    with Studio(path) as found:
        yield found


@pytest.fixture
def page(browser, studio) -> Iterator:
    """A new tab with the small quickstart."""
    from tests.extensions.pages.browser import new_tab
    from tests.extensions.studio.chromium import opened_anew

    with new_tab(browser) as found:
        opened_anew(found, studio)
        yield found
        assert found.errors == []
