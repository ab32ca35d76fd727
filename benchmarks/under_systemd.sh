#!/usr/bin/env bash
# deploy/thrustd.service under a real systemd: benchmarks/under_systemd.sh     (root, Debian with systemd; nothing remains)
# systemd runs as PID 1 of namespaces of its own and knows only this unit. The unit is started, its process killed with
# SIGKILL, then stopped with SIGSTOP until the watchdog acts, then ended in order. Configuration: hil.toml's wires with
# nobody on them, so it flies and says what it misses.
set -euo pipefail
root=$(dirname "$(dirname "$(realpath "$0")")")
if [ "${1:-}" != inside ]; then
    group=/sys/fs/cgroup/systemd/thrustd-unit-test
    said=$(mktemp)
    mkdir -p "$group"
    (echo "$BASHPID" >"$group/cgroup.procs"
    exec timeout -s KILL 240 unshare --mount --pid --fork --kill-child --cgroup --uts --ipc --net "$0" inside) >"$said" &
    tail -f --pid=$! "$said" | sed '/^stopped/q'
    kill -KILL $! 2>/dev/null && wait $! 2>/dev/null || true
    rm "$said"
    sleep 1
    find "$group" -depth -type d -exec rmdir {} \;
    exit
fi

mount -t proc proc /proc && mount --bind /proc/sys /proc/sys && mount -o remount,bind,ro /proc/sys
umount -l /sys/fs/cgroup && mount -t tmpfs tmpfs /sys/fs/cgroup && mkdir /sys/fs/cgroup/systemd
mount -t cgroup -o none,name=systemd,xattr cgroup /sys/fs/cgroup/systemd
for folder in /run /opt /var/lib /var/cache; do mount -t tmpfs -o mode=755 tmpfs $folder; done
ip link set lo up

# what install.sh would have put there, with the packages of this checkout's environment
mkdir -p /run/units /run/etc /opt/thrustd/current/bin /var/cache/thrustd /var/lib/thrustd
packages=$(echo "$root"/.venv/lib/python3*/site-packages)
cp -r "$root"/thrustd "$root"/thrustd.egg-info "$root"/models "$root"/deploy /opt/thrustd/current/
printf '#!/bin/sh\nPYTHONPATH=/opt/thrustd/current:%s exec /usr/bin/python3 -m thrustd "$@"\n' "$packages" \
    >/opt/thrustd/current/bin/thrustd
chmod 755 /opt/thrustd/current/bin/thrustd
(cat /etc/passwd && echo 'thrustd:x:990:990::/nonexistent:/usr/sbin/nologin') >/run/etc/passwd
(cat /etc/group && echo 'thrustd:x:990:') >/run/etc/group
for name in passwd group; do mount --bind /run/etc/$name /etc/$name; done
sed -i 's|/tmp/thrustd-hil-can|/var/lib/thrustd/can|; s|\.\./out/hil|/var/lib/thrustd|' \
    /opt/thrustd/current/deploy/hil.toml
sed 's|/etc/thrustd/deploy/ph-lab.toml|/opt/thrustd/current/deploy/hil.toml|' "$root/deploy/thrustd.service" \
    >/run/units/thrustd.service
for target in basic sysinit shutdown umount local-fs network-pre multi-user final; do
    printf '[Unit]\nDefaultDependencies=no\n' >/run/units/$target.target
done
chown -R 990:990 /var/lib/thrustd /var/cache/thrustd

state() { systemctl show thrustd -p "$1" --value; }
await() { # command that must become true; prints after how long
    local begin=${EPOCHREALTIME/./}
    until "${@:2}"; do sleep 0.05; done
    echo "$1 after $(((${EPOCHREALTIME/./} - begin) / 1000)) ms"
}
ready() { [ "$(state ActiveState)" = active ] && [ "$(state NRestarts)" = "$1" ]; }
beating() { [[ $(state StatusText) == *" N"* || $(state StatusText) == *lost* ]]; }
scenario() {
    await "first READY (compiles its models)" ready 0
    await "first heartbeat" beating
    echo "status: $(state StatusText)"
    kill -KILL "$(state MainPID)"
    await "READY again (kill -9)" ready 1
    kill -STOP "$(state MainPID)"
    await "READY again (hung: watchdog)" ready 2
    echo "last result before: $(systemctl show thrustd -p Result --value), restarts $(state NRestarts)"
    systemctl stop thrustd
    echo "stopped: $(state ActiveState), exit status $(state ExecMainStatus)"
}
export -f state await ready beating scenario
(sleep 1 && bash -c scenario) </dev/null &
exec env -i container=docker SYSTEMD_UNIT_PATH=/run/units PATH=/usr/bin:/usr/sbin:/bin \
    /usr/lib/systemd/systemd --system --log-target=null --unit=thrustd.service
