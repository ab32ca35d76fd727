# Which version flies: sourced by install.sh and rollback.sh, never run by itself.
# A version is a folder under $home/versions: an environment of its own, and in `system/` what the system keeps of it.
root=${DESTDIR:-}
home=$root/opt/thrustd
systemctl=${SYSTEMCTL:-$([ -z "$root" ] && echo systemctl || echo true)} # nothing is started in another folder

link() { # NAME TARGET: replaced in one step, there is no moment without it
    ln -sfn "$2" "$home/.$1" && mv -T "$home/.$1" "$home/$1"
}

place() { # FOLDER: its unit, wires and user; installations from before they were kept have none
    [ -d "$1" ] || return 0
    install -Dm644 "$1/thrustd.service" "$root/etc/systemd/system/thrustd.service" &&
        install -Dm644 "$1/80-thrustd-can.network" "$root/etc/systemd/network/80-thrustd-can.network" &&
        install -Dm644 "$1/70-thrustd.rules" "$root/etc/udev/rules.d/70-thrustd.rules" &&
        install -Dm644 "$1/thrustd.sysusers" "$root/usr/lib/sysusers.d/thrustd.conf"
}

fly() { # VERSION FOLDER (versions/...): false when it does not get READY
    place "$home/$1/system" && link current "$1" &&
        "$systemctl" daemon-reload && "$systemctl" enable --quiet thrustd && "$systemctl" restart thrustd
}

switch_to() { # VERSION FOLDER: flies it; one that does not get READY is left for the one that flew before
    local before
    before=$(readlink "$home/current" || true)
    if fly "$1"; then
        [ -z "$before" ] || [ "$before" = "$1" ] || link previous "$before"
        return 0
    fi
    echo "$1 does not start" >&2
    if [ -z "$before" ] || [ "$before" = "$1" ]; then
        return 1
    fi
    fly "$before" && echo "${before#versions/} is current again" >&2
    return 1
}
