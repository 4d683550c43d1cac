"""These tests compile: they neither use nor fill the user's own cache."""

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """An empty disk cache for this run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ARMBLOCKS_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield
