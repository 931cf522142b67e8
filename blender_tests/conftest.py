# SPDX-License-Identifier: Apache-2.0
"""Fixtures of all tests: the core module, one Vulkan context a tracer, and the rule that validation layers stay silent.

Environment (set by ./dev test):
  HEADWATER_VALIDATION=1          the core uses the Khronos validation layers, in every process that a test starts;
                                  any message fails the test in which it came
  HEADWATER_REQUIRE_RAY_QUERY=1   a test marked ray_query fails, instead of being skipped, where no device has it
"""

import collections
import functools
import os
import tempfile
from pathlib import Path

import alone
import pytest

VALIDATION = os.environ.get("HEADWATER_VALIDATION") == "1"
REQUIRE_RAY_QUERY = os.environ.get("HEADWATER_REQUIRE_RAY_QUERY") == "1"


def pytest_configure(config):
    config.pluginmanager.register(alone.Alone(config), "alone")


def pytest_terminal_summary(terminalreporter):
    """Where the time went: the dearest files, beside the dearest tests that pytest names."""
    seconds = collections.Counter()
    for report in (r for group in terminalreporter.stats.values() for r in group if hasattr(r, "duration")):
        seconds[report.nodeid.split("::")[0]] += report.duration
    terminalreporter.section(f"dearest files of {sum(seconds.values()):.0f} s")
    for name, took in seconds.most_common(12):
        terminalreporter.write_line(f"{took:6.0f} s {name}")


@pytest.fixture(scope="session")
def _validation_log():
    """The file that gathers the layers' messages of this process and of all it starts; None without validation."""
    if not VALIDATION:
        yield None
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "validation.log")
        os.environ["HEADWATER_VALIDATION_LOG"] = str(path)
        yield path
        del os.environ["HEADWATER_VALIDATION_LOG"]


def _no_messages_during(log):
    """Generator: remembers the end of the log, and after the yield fails when there is more."""

    def text():
        return log.read_text(errors="replace") if log is not None and log.is_file() else ""

    before = len(text())
    yield
    messages = text()[before:]
    if messages:
        pytest.fail(f"validation layers spoke:\n{messages[:4000]}", pytrace=False)


@pytest.fixture(autouse=True)
def validation_silent(_validation_log):
    """Fails a test during which the validation layers spoke, here or in a process that it started."""
    yield from _no_messages_during(_validation_log)


@pytest.fixture(autouse=True, scope="module")
def validation_silent_around(_validation_log):
    """The same for what a module's own fixtures do, before its first test and after its last."""
    yield from _no_messages_during(_validation_log)


@pytest.fixture(scope="session")
def core():
    """The native module headwater._core."""
    import headwater._core as module

    return module


@functools.cache
def _any_ray_query():
    import headwater._core as module

    return any(d["usable"] and d["ray_query"] and d["ray_pipeline"] for d in module.devices())


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Skips (or fails) tests marked ray_query before any of their fixtures open a device."""
    if item.get_closest_marker("ray_query") is None or _any_ray_query():
        return
    message = "no Vulkan device with ray query and ray tracing pipelines here"
    pytest.fail(message) if REQUIRE_RAY_QUERY else pytest.skip(message)


@pytest.fixture(scope="session")
def make_context(core):
    """make_context(tracer="embree", **kwargs) -> Context, one for all tests: to make kernels takes longer than pictures
    of tests do."""
    contexts = {}

    def make(tracer="embree", **kwargs):
        key = (tracer, os.environ.get(alone.DRIVER), *sorted(kwargs.items()))
        if key not in contexts:
            contexts[key] = core.Context(tracer=tracer, **kwargs)
        return contexts[key]

    yield make
    contexts.clear()


@pytest.fixture(
    params=["embree"] + [pytest.param(name, marks=pytest.mark.ray_query) for name in ("ray_query", "ray_pipeline")],
    scope="module",
)
def tracer(request):
    """Runs a test once with each Tracer; the ray_query turn is skipped where no device has it."""
    return request.param
