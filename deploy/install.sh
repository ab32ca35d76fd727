#!/usr/bin/env bash
# Install or upgrade:  deploy/install.sh dist/thrustd-0.1.0-py3-none-any.whl        Back:  deploy/rollback.sh
# Every installation is a whole environment of its own, also the second of the same version; what flies is one symbolic
# link. It is switched only when the new one has read this aircraft's configuration, and back when it does not start.
# DESTDIR=somewhere tries it elsewhere.
set -euo pipefail
wheel=$(realpath -e "${1:?expected a wheel: deploy/install.sh dist/thrustd-VERSION-py3-none-any.whl}")
here=$(dirname "$(realpath "$0")")
. "$here/switch.sh"

number=1
version=$(basename "$wheel" | cut -d- -f2)
while [ -e "$home/versions/$version.$number" ]; do number=$((number + 1)); done
name=versions/$version.$number
new=$home/$name
trap 'rm -rf "$new"; echo "not installed; what flies is as it was" >&2' EXIT

install -d "$home/versions" "$root/etc/thrustd/deploy"
"${PYTHON:-python3}" -m venv "$new"
"$new/bin/pip" install --quiet --disable-pip-version-check --require-hashes --no-deps -r "$here/requirements.txt"
"$new/bin/pip" install --quiet --disable-pip-version-check --no-deps "$wheel"
install -Dm644 -t "$new/system" "$here"/thrustd.service "$here"/80-thrustd-can.network "$here"/70-thrustd.rules \
    "$here"/thrustd.sysusers

# configuration and models of this aircraft are never overwritten
cp -n "$here"/ph-lab.toml "$here"/citation-ii.toml "$here"/canaerospace.dbc "$root/etc/thrustd/deploy/"
cp -rn "$here"/../models "$root/etc/thrustd/"

check=("$new/bin/thrustd" check "$root/etc/thrustd/deploy/ph-lab.toml") # compiles now, not at the first start
key=$root/etc/thrustd-trust.pem # see thrustd.service
[ ! -e "$key" ] || check+=(--trust "$key")
if [ -z "$root" ]; then
    install -Dm644 "$here/thrustd.sysusers" /usr/lib/sysusers.d/thrustd.conf
    systemd-sysusers
    install -d -o thrustd -g thrustd /var/cache/thrustd /var/lib/thrustd
    runuser -u thrustd -- env NUMBA_CACHE_DIR=/var/cache/thrustd/numba "${check[@]}"
else
    "${check[@]}"
fi

trap - EXIT
if ! switch_to "$name"; then
    rm -rf "$new"
    exit 1
fi
[ -n "$root" ] || udevadm control --reload
for old in "$home"/versions/*; do # what neither flies nor flew before
    case versions/$(basename "$old") in
    "$(readlink "$home/current")" | "$(readlink "$home/previous" || true)") ;;
    *) rm -rf "$old" ;;
    esac
done
echo "thrustd $version.$number is current"
