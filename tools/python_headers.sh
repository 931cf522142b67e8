#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Unpacks the headers of Python 3.13 from Debian 13 into a folder of its own: nanobind's stable ABI needs headers of 3.12
# or later, and Debian 12 has 3.11. Only headers: which Python runs the module is decided where it is loaded.
#
#   tools/python_headers.sh FOLDER     → FOLDER/include/python3.13
set -euo pipefail
target=${1:?folder}
# shellcheck source=tools/private_apt.sh
. "$(dirname "${BASH_SOURCE[0]}")/private_apt.sh"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
private_apt "$work" /dev/null trixie
(cd "$work" && apt-get -q download libpython3.13-dev && dpkg-deb -x libpython3.13-dev_*.deb root)
[ -f "$work/root/usr/include/python3.13/Python.h" ] || { echo "the package holds no Python.h" >&2; exit 1; }
rm -rf "$target"
mkdir -p "$(dirname "$target")"
mkdir "$target"
mv "$work/root/usr/include" "$target/include"
