"""JSON messages by topic, gathered into columns."""

from typing import Any, NamedTuple

import numpy as np


class Topic(NamedTuple):
    """Times and fields of one topic, as they came."""

    times_ns: list[int]
    fields: dict[str, list[float]]


def append(topic: Topic, time_ns: int, message: Any) -> None:
    """One row; a field that is missing, null or not a number is NaN there."""
    if not isinstance(message, dict):
        return
    level(topic)
    topic.times_ns.append(time_ns)
    for name, value in message.items():
        if value is None or isinstance(value, int | float):
            column = topic.fields.get(name)
            if column is None:
                column = topic.fields[name] = [np.nan] * (len(topic.times_ns) - 1)
            column.append(np.nan if value is None else float(value))


def level(topic: Topic) -> None:
    """Fill up the columns that the last row did not have."""
    count = len(topic.times_ns)
    for column in topic.fields.values():
        if len(column) < count:
            column.append(np.nan)
