#!/usr/bin/env bash
# Install or upgrade:  deploy/install.sh dist/thrustd-0.1.0-py3-none-any.whl        Back:  deploy/rollback.sh
# Every version is a whole environment of its own; what flies is one symbolic link. DESTDIR=somewhere tries it elsewhere.
set -euo pipefail
wheel=$(realpath "$1")
here=$(dirname "$(realpath "$0")")
root=${DESTDIR:-}
version=$(basename "$wheel" | cut -d- -f2)
home=$root/opt/thrustd
new=$home/versions/$version

install -d "$home/versions" "$root/etc/thrustd/deploy" "$root/etc/systemd/system" "$root/etc/systemd/network" \
    "$root/etc/udev/rules.d" "$root/usr/lib/sysusers.d"
rm -rf "$new.part"
"${PYTHON:-python3}" -m venv "$new.part"
"$new.part/bin/pip" install --quiet --disable-pip-version-check --require-hashes --no-deps \
    -r "$here/requirements.txt"
"$new.part/bin/pip" install --quiet --disable-pip-version-check --no-deps "$wheel"
rm -rf "$new"
mv "$new.part" "$new"
sed -i "s|$new.part|$new|g" "$new"/bin/*  2>/dev/null || true

# configuration and models of this aircraft are never overwritten
cp -n "$here"/ph-lab.toml "$here"/canaerospace.dbc "$root/etc/thrustd/deploy/"
cp -rn "$here"/../models "$root/etc/thrustd/"
cp "$here"/thrustd.service "$root/etc/systemd/system/"
cp "$here"/80-thrustd-can.network "$root/etc/systemd/network/"
cp "$here"/70-thrustd.rules "$root/etc/udev/rules.d/"
cp "$here"/thrustd.sysusers "$root/usr/lib/sysusers.d/thrustd.conf"

current=$(readlink "$home/current" || true)
if [ -n "$current" ] && [ "$current" != "versions/$version" ]; then
    ln -sfn "$current" "$home/.previous" && mv -T "$home/.previous" "$home/previous"
fi
ln -sfn "versions/$version" "$home/.current" && mv -T "$home/.current" "$home/current"

if [ -z "$root" ]; then
    systemd-sysusers
    install -d -o thrustd -g thrustd /var/cache/thrustd /var/lib/thrustd
    # compile now, not at the first start
    runuser -u thrustd -- env NUMBA_CACHE_DIR=/var/cache/thrustd/numba \
        "$home/current/bin/thrustd" check /etc/thrustd/deploy/ph-lab.toml
    udevadm control --reload
    systemctl daemon-reload
    systemctl enable --quiet thrustd
    systemctl restart thrustd
fi
echo "thrustd $version is current"
