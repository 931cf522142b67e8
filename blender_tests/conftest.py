# SPDX-License-Identifier: Apache-2.0
"""Fixtures of all tests: the core module, Vulkan contexts by tracer, and the rule that validation layers stay silent.

Environment (set by ./dev test):
  HEADWATER_VALIDATION=1          contexts are made with the Khronos validation layers; any message fails its module
  HEADWATER_REQUIRE_RAY_QUERY=1   a test marked ray_query fails, instead of being skipped, where no device has it
"""

import functools
import os

import pytest

VALIDATION = os.environ.get("HEADWATER_VALIDATION") == "1"
REQUIRE_RAY_QUERY = os.environ.get("HEADWATER_REQUIRE_RAY_QUERY") == "1"


@pytest.fixture(scope="session")
def core():
    """The native module headwater._core."""
    import headwater._core as module

    return module


@functools.cache
def _any_ray_query():
    import headwater._core as module

    return any(device["usable"] and device["ray_query"] for device in module.devices())


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Skips (or fails) tests marked ray_query before any of their fixtures open a device."""
    if item.get_closest_marker("ray_query") is None or _any_ray_query():
        return
    message = "no Vulkan device with ray query here"
    pytest.fail(message) if REQUIRE_RAY_QUERY else pytest.skip(message)


@pytest.fixture(scope="module")
def make_context(core):
    """make_context(tracer="embree", **kwargs) -> Context, kept for the module: devices are dear to open.

    After the module's last test, every context must have had no validation message.
    """
    contexts = {}

    def make(tracer="embree", **kwargs):
        key = (tracer, *sorted(kwargs.items()))
        if key not in contexts:
            contexts[key] = core.Context(tracer=tracer, validation=VALIDATION, **kwargs)
        return contexts[key]

    yield make
    noisy = {key: context.validation_messages for key, context in contexts.items() if context.validation_messages}
    contexts.clear()
    assert not noisy, f"validation layers spoke, messages by context: {noisy}"


@pytest.fixture(
    params=["embree", pytest.param("ray_query", marks=pytest.mark.ray_query)],
    scope="module",
)
def tracer(request):
    """Runs a test once with each Tracer; the ray_query turn is skipped where no device has it."""
    return request.param
