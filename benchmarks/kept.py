"""What a long benchmark found, a line of JSON each: it goes on where it stopped."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple


class Kept(NamedTuple):
    """Lines of a file; with a `key` only those that were kept under it."""

    path: Path
    key: str | None = None

    def rows(self) -> list[dict[str, Any]]:
        lines = self.path.read_text().splitlines() if self.path.exists() else []
        return [row for row in map(json.loads, lines) if self.key in (None, row.get("key"))]

    def add(self, row: Mapping[str, Any]) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a") as file:
            file.write(json.dumps({**row} if self.key is None else {"key": self.key, **row}) + "\n")
