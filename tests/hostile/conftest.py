import pytest

from hostile.worker import load_libraries


@pytest.fixture(scope="session")
def libraries() -> None:
    """Have them before forks, which need not import them, and before a limit on what is written."""
    load_libraries()
    b"".decode("utf-8-sig")
