"""What a pipeline remembers across a restart, as read from a checkpoint that may say anything."""

from collections.abc import Mapping
from typing import Any

import msgspec

MAX_TIME_NS = 2**62


class Memory(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A snapshot of a pipeline; its parts check what is theirs."""

    t_ns: tuple[int, int]  # last fused step, first one
    sample: tuple[int, int]  # time and sequence of the last ADC sample
    mounts: list[dict[str, list[float]]]
    filters: list[dict[str, list[float]]]
    hand_overs: list[list[float | None]]
    monitor: dict[str, Any]
    hold: list[list[Any]]
    service_s: list[float]  # of the mounts, with their engine running


def read_memory(snapshot: Mapping[str, Any], mounts: int, engines: int, shift_ns: int) -> Memory | None:
    """The snapshot with its times moved by `shift_ns`; None when it is not one of so many mounts and engines."""
    try:
        memory = msgspec.convert(snapshot, Memory)
    except msgspec.ValidationError:
        return None
    times = [*memory.t_ns, memory.sample[0]]
    if {len(memory.mounts), len(memory.service_s)} != {mounts} or {len(memory.filters), len(memory.hand_overs)} != {
        engines
    }:
        return None
    if max(map(abs, times)) > MAX_TIME_NS:
        return None
    for state in memory.filters:
        if state.get("clock"):
            state["clock"][0] += shift_ns
    return msgspec.structs.replace(
        memory,
        t_ns=(memory.t_ns[0] + shift_ns, memory.t_ns[1] + shift_ns),
        sample=(memory.sample[0] + shift_ns, memory.sample[1]),
    )


def plain(memory: dict[str, Any]) -> dict[str, Any]:
    """The same in JSON's own types: numpy's scalars become numbers."""
    return msgspec.to_builtins(memory, enc_hook=float)
