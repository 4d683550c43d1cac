"""The tests of the integrators use an empty disk cache: they neither read nor fill the cache of the user."""

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Set an empty disk cache for this test session."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ARMBLOCKS_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield
