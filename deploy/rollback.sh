#!/usr/bin/env bash
# Fly the version before the current one again; once more goes forward again.
set -euo pipefail
home=${DESTDIR:-}/opt/thrustd
previous=$(readlink "$home/previous") || { echo "there is no previous version" >&2; exit 1; }
current=$(readlink "$home/current")
ln -sfn "$current" "$home/.previous" && mv -T "$home/.previous" "$home/previous"
ln -sfn "$previous" "$home/.current" && mv -T "$home/.current" "$home/current"
[ -n "${DESTDIR:-}" ] || systemctl restart thrustd
echo "${previous#versions/} is current"
