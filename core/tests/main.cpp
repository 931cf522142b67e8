// SPDX-License-Identifier: Apache-2.0
// Entry point of the C++ unit tests (doctest). Tests stand in test_*.cpp beside this file.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
