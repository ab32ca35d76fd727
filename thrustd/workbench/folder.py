"""The folder the page works on: which recordings and models it holds, and the one gate through which names pass.

FOLDER/                     recordings (CSV, Parquet, npz, MAT, MCAP) and models (JSON), subfolders one deep
FOLDER/.thrustd/            state of the page; may be deleted while no page is open
    columns/ tables/ jobs/ reports/ incoming/ undone/ sealed/ mappings.json session.json
"""

import hashlib
import os
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec

from thrustd.core.columns import Floats
from thrustd.core.errors import ModelError, UsageError
from thrustd.model.artifact import MAX_BYTES, SCHEMA, ModelSpec
from thrustd.model.compile import read_proven_model
from thrustd.records.marks import read_marks
from thrustd.sources.mcap_walk import MAGIC
from thrustd.workbench.columns import Columns, columns_key, open_columns
from thrustd.workbench.lines import Line
from thrustd.workbench.mapping import ColumnNames, read_said, read_table

STATE = ".thrustd"
RECORDING_TYPES = (".csv", ".parquet", ".npz", ".mat", ".mcap")
MODEL_TYPE = ".json"
MAX_NAME = 120  # characters
OPEN = 24  # sets of columns mapped at a time
SILENT_S = 10.0  # a log without its end that nobody wrote to for so long was cut off


class Folder:
    """Names are relative with `/`; whatever leads outside, or into hidden files, does not exist."""

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()
        self.state = self.root / STATE
        self._models: dict[str, tuple[str, ModelSpec]] = {}
        self._open: dict[Path, Columns] = {}
        self._tables: dict[Path, dict[str, Any]] = {}
        if not self.root.is_dir():
            raise UsageError(f"{root}: expected a folder with recordings and models")

    def path(self, name: str) -> Path:
        """The file of that name; UsageError when it leads outside or there is none."""
        path = self.new_path(name)
        if not path.is_file():
            raise UsageError(f"{name[:MAX_NAME]!r}: no such file in the folder")
        return path

    def new_path(self, name: str) -> Path:
        """Where a file of that name belongs; UsageError for a name that is not plain or leads outside."""
        if not _is_plain(name):
            raise UsageError(f"{name[:MAX_NAME]!r}: not a file of the folder; expected a plain name")
        path = Path(os.path.realpath(self.root / name))
        if not path.is_relative_to(self.root):
            raise UsageError(f"{name!r}: leads outside the folder")
        return path

    def name(self, path: Path) -> str:
        return path.relative_to(self.root).as_posix()

    def recordings(self) -> list[str]:
        return [self.name(path) for path in self._files() if path.suffix.lower() in RECORDING_TYPES]

    def models(self) -> list[str]:
        return [name for name in map(self.name, self._files()) if self._is_model(name)]

    def model(self, name: str) -> ModelSpec:
        """The model, parsed again only when its file changed."""
        path = self.path(name)
        key = columns_key(path)
        held = self._models.get(name)
        if held is None or held[0] != key:
            held = self._models[name] = (key, read_proven_model(path.read_bytes(), name))
        return held[1]

    def table(self, name: str) -> dict[str, Any] | None:
        """The columns of the file as it calls them, and what they may be; None while it was not read."""
        path = self.table_path(name)
        if path not in self._tables:
            if not path.exists():
                return None
            self._tables[path] = read_table(path)
        return self._tables[path]

    def mapping(self, name: str) -> ColumnNames:
        """What the columns of the file are called here; nothing changed where nobody said so."""
        table = self.table(name)
        return ColumnNames() if table is None else read_said(self.state).of(name, table["columns"])

    def table_path(self, name: str) -> Path:
        """Where the columns of the file are kept as it calls them."""
        return self.state / "tables" / f"{columns_key(self.path(name))}.json"

    def columns_folder(self, name: str) -> Path:
        mapping = self.mapping(name)
        said = "" if mapping == ColumnNames() else msgspec.json.encode(mapping).decode()
        return self.state / "columns" / columns_key(self.path(name), said)

    def key(self, name: str) -> str:
        """Changes whenever a recording or model does: its file, what its columns are, which stretches are left out."""
        path = self.path(name)
        if path.suffix.lower() == MODEL_TYPE:
            return columns_key(path)
        out = [f"{mark.start_s!r} to {mark.stop_s!r}" for mark in read_marks(path) if mark.exclude]
        return " ".join([self.columns_folder(name).name, *out])

    def reading(self, name: str) -> dict[str, str]:
        """Where every column of a recording comes from: its file, and what was said of it there."""
        mapping = self.mapping(name)
        said = {column.ours: column.spelled for column in mapping.columns}
        return {"": f"{columns_key(self.path(name))} {mapping.rate_hz}"} | said

    def model_columns_folder(self, recording: str, model: str) -> Path:
        return self.columns_folder(recording) / columns_key(self.path(model))

    def columns(self, recording: str) -> Columns | None:
        """The prepared columns of a recording; None while there are none."""
        return self._opened(self.columns_folder(recording), None)

    def model_columns(self, recording: str, model: str) -> Columns | None:
        """The columns of a model run on a recording; None while there are none."""
        base = self.columns(recording)
        return None if base is None else self._opened(self.model_columns_folder(recording, model), base.time_s)

    def line(self, recording: str, label: str) -> Line:
        """`channel` of the recording, or `model@FILE` and `residual@FILE` of a model run on it."""
        kind, _, model = label.partition("@")
        columns = self.model_columns(recording, model) if model else self.columns(recording)
        if columns is None or kind not in columns:
            raise UsageError(f"{recording}: no prepared channel {label!r}")
        return Line(label, columns, kind)

    def _opened(self, folder: Path, time_s: Floats | None) -> Columns | None:
        """Maps are kept open, the latest `OPEN` of them."""
        held = self._open.pop(folder, None)
        found = held if held is not None and folder.exists() else open_columns(folder, time_s)
        if found is not None:
            self._open[folder] = found
        while len(self._open) > OPEN:
            del self._open[next(iter(self._open))]
        return found

    def stamp(self) -> str:
        """Another one whenever a file is added, removed or written, or something else is chosen or said of columns."""
        said = hashlib.sha256()
        for path in (*self._files(), self.state / "session.json", self.state / "mappings.json"):
            with suppress(FileNotFoundError):  # not written yet, or removed since it was listed
                said.update(f"{columns_key(path)}{_growing(path):d}".encode())
        return said.hexdigest()[:20]

    def growing(self, name: str) -> bool:
        """A flight log that a daemon is writing just now."""
        return _growing(self.path(name))

    def _files(self) -> Iterator[Path]:
        for path in sorted(self.root.iterdir()):
            if path.name.startswith("."):
                continue
            if path.is_dir() and not path.is_symlink():
                yield from (inner for inner in sorted(path.iterdir()) if self._is_ours(inner))
            elif self._is_ours(path):
                yield path

    def _is_ours(self, path: Path) -> bool:
        """What every page may ask for: files of other names are not shown, for none could be opened."""
        known = path.suffix.lower() in (*RECORDING_TYPES, MODEL_TYPE) and _is_plain(self.name(path))
        return known and path.is_file() and path.resolve().is_relative_to(self.root)

    def _is_model(self, name: str) -> bool:
        path = self.root / name
        if path.suffix.lower() != MODEL_TYPE or path.stat().st_size > MAX_BYTES:
            return False
        with path.open("rb") as file:
            return SCHEMA.encode() in file.read(400)


def _is_plain(name: str) -> bool:
    """Of a file in the folder or in one of its folders, shown and sent as it is."""
    parts = name.split("/")
    plain = all(part and not part.startswith(".") and part.isprintable() and "\\" not in part for part in parts)
    return plain and len(parts) <= 2 and len(name) <= MAX_NAME


class ModelCard(msgspec.Struct, frozen=True):
    """What the overview says of one model."""

    name: str
    title: str
    structure: str
    effects: list[dict[str, object]]
    ledger: list[dict[str, object]]
    deformation_mm: tuple[float, float]
    force_n: tuple[float, float]
    parent: str  # file name of the parent, empty without
    provenance: dict[str, object]
    key: str  # changes with the file
    problem: str = ""  # the one line that says why it cannot be used


def model_cards(folder: Folder) -> list[ModelCard]:
    """Every model of the folder; one that cannot be read carries its problem."""
    cards = []
    for name in folder.models():
        try:
            cards.append(_card(name, folder.model(name), folder.key(name)))
        except (ModelError, UsageError) as problem:
            cards.append(ModelCard(name, name, "", [], [], (0, 0), (0, 0), "", {}, "", problem=str(problem)))
    return cards


def _card(name: str, spec: ModelSpec, key: str) -> ModelCard:
    return ModelCard(
        name,
        spec.name,
        spec.structure,
        [msgspec.to_builtins(effect) for effect in spec.effects],
        [msgspec.to_builtins(entry) for entry in spec.ledger],
        spec.valid.deformation_mm,
        spec.valid.force_n,
        str(spec.provenance.get("parent", "")),
        dict(spec.provenance),
        key,
    )


def _growing(path: Path) -> bool:
    if path.suffix.lower() != ".mcap" or time.time() - path.stat().st_mtime > SILENT_S:
        return False
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - len(MAGIC), 0))
        return file.read() != MAGIC  # the last bytes of a log that was closed
