"""Fixtures for every test: one headless context, checked for GL errors, and the flags of this suite."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import pytest

if TYPE_CHECKING:
    from app.gpu import Gpu

# What macOS lacks: Mesa gives a 4.5 context even when 4.1 is asked for
GL41 = {
    "MESA_GL_VERSION_OVERRIDE": "4.1",
    "MESA_GLSL_VERSION_OVERRIDE": "410",
    "MESA_EXTENSION_OVERRIDE": "-GL_ARB_compute_shader -GL_ARB_shader_storage_buffer_object "
    "-GL_ARB_shader_image_load_store -GL_ARB_shading_language_420pack",
}

LONGEST = ("desktop", "screenshots", "web")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--gl41", action="store_true", help="run in an OpenGL 4.1 context, as macOS has it")
    parser.addoption("--kills", type=int, default=1, help="random moments at which each bake is killed and resumed")
    parser.addoption("--regenerate-screenshots", action="store_true", help="write the goldens instead of comparing")


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("--gl41"):
        os.environ |= GL41
    config.addinivalue_line("markers", "display: needs an X server or Xvfb")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest come first: none is left to one worker at the end."""
    items.sort(key=lambda item: item.path.parent.name not in LONGEST)


def pytest_collection_finish() -> None:
    """Tests that look for what was let go need not look through all that has been imported by now, each time."""
    gc.collect()
    gc.freeze()


SESSION_GPU = pytest.StashKey["Gpu"]()


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Commands that tests run in this process make a context of their own: go back to the shared one, if there is one yet."""
    if (gpu := item.config.stash.get(SESSION_GPU, None)) is not None:
        gpu.ctx.__enter__()


@pytest.fixture(scope="session")
def _gpu(request: pytest.FixtureRequest) -> Iterator[Gpu]:
    from app.gpu import headless_gpu

    gpu = headless_gpu()
    if request.config.getoption("--gl41"):
        assert gpu.limits.gl == 410, f"--gl41 asked for 4.1, but this driver gives {gpu.limits.gl}"
    request.config.stash[SESSION_GPU] = gpu
    yield gpu
    gpu.release()


@pytest.fixture
def gpu(_gpu: Gpu) -> Iterator[Gpu]:
    """A headless context. Fails on a GL error left by this test or by the one before."""
    assert _gpu.ctx.error == "GL_NO_ERROR", "a GL error was pending before the test"
    yield _gpu
    assert _gpu.ctx.error == "GL_NO_ERROR"


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(2003)


@pytest.fixture
def few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """The error estimate looks from few points: where it is not what is tested, and would take most of the time."""
    for name in ("SURVEYED", "POINTS", "HELPERS"):
        monkeypatch.setattr(f"app.estimate.error.{name}", 64)


@pytest.fixture
def undivided(monkeypatch: pytest.MonkeyPatch) -> None:
    """A lamp shoots from patches as large as any other: as one of so many lamps that none holds much of the light."""
    monkeypatch.setattr("app.solvers.shooting.emitter_groups.MOST", 1.0)
