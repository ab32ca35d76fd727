#!/usr/bin/env bash
# Fly the installation before the current one again, with its unit; once more goes forward again.
set -euo pipefail
. "$(dirname "$(realpath "$0")")/switch.sh"
previous=$(readlink "$home/previous") || { echo "there is no previous version" >&2; exit 1; }
switch_to "$previous"
echo "${previous#versions/} is current"
