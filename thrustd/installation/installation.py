"""An installation: a configuration with every file it names, read, checked and built into a pipeline.

The texts of all files go into every log, so that a log can be replayed anywhere with what flew.
"""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import msgspec

from thrustd.brochure.deck import Deck
from thrustd.core.aircraft import DATA, AircraftData, MountPlace, place_of, read_aircraft
from thrustd.core.calibration import Calibration, read_calibration
from thrustd.core.config import Config, Mount, read_config, section
from thrustd.core.errors import ConfigError, LogError, ModelError
from thrustd.core.signals import CATALOGUE
from thrustd.fusion.settings import FusionSettings, check_settings
from thrustd.installation.as_calibrated import as_calibrated, as_estimated, check_names, placed
from thrustd.installation.shipped import shipped
from thrustd.installation.signature import SIGNATURE, check_signature, manifest
from thrustd.model.artifact import ModelSpec, read_model
from thrustd.model.calibrated import calibrated
from thrustd.model.compile import CompiledModel, compile_model, read_proven_model
from thrustd.model.effects import effect_named
from thrustd.pipeline.pipeline import DERIVED, Parts, Pipeline
from thrustd.sources.plain_file import read_plain
from thrustd.wire.adc_frames import encode
from thrustd.wire.can_frames import ICD_INPUT_ROWS, ICD_OPTIONAL_ROWS
from thrustd.wire.can_table import CanRow, CanTable, CanUnits
from thrustd.wire.log_layout import LogHeader

CONFIG = "config.toml"  # name of the configuration among the files of a log
WARM_START = "warm_start"  # note in a log's header: the WarmStart (JSON) of its run
MAX_FILE_BYTES = 4_000_000
BITS_PER_BYTE = 10  # 8N1
LOAD_FACTORS = ("axial_inertia", "engine_weight")  # effects that every mount in flight needs and no bench shows


@dataclass(frozen=True, slots=True)
class Installation:
    """Configuration, the files it names (name in the configuration -> bytes), and where it came from."""

    config: Config
    files: Mapping[str, bytes]  # CONFIG and every file named in it
    where: str

    def pipeline(self) -> Pipeline:
        """A fresh pipeline; compiles the models, so that nothing compiles afterwards."""
        return Pipeline(self.config, self.parts())

    def warm_pipeline(self, start: "WarmStart | None") -> tuple[Pipeline, bool]:
        """A pipeline that goes on from `start`, and whether it does; a fresh one when the snapshot does not fit."""
        parts = self.parts()
        pipeline = Pipeline(self.config, parts)
        if start is None:
            return pipeline, False
        if start.snapshot is None:
            if len(start.service_s) == len(self.config.mount):
                pipeline.serve_from(start.service_s)
            return pipeline, False
        if pipeline.restore(start.snapshot, start.shift_ns):
            return pipeline, True
        return Pipeline(self.config, parts), False

    def parts(self) -> Parts:
        """Models, deck and CAN table, checked against what the aircraft delivers."""
        config = self.config
        _check_line(config, self.where)
        where = f"{self.where}: fusion"
        check_settings(section(config.fusion, FusionSettings, where), where)
        aircraft = self.aircraft()
        table = self.heard()
        heard = {(field.signal, field.index) for message in table.messages.values() for field in message.fields}
        calibration, models = self.calibration(), []
        for mount in config.mount:
            model = compile_model(self.model(mount), config.adc.sample_hz)
            scopes = {"engine": config.aircraft.engines.index(mount.engine), "mount": config.mount.index(mount)}
            _check_channels(model, heard, scopes, self._place(mount.model))
            models.append(model)
        mounts = tuple(calibration.of(mount.name) for mount in config.mount) if calibration is not None else ()
        return Parts(tuple(models), self.deck(), table, aircraft, mounts)

    def deck(self) -> Deck:
        """With what is not sure of its fuel."""
        name = self.config.deck
        return Deck.from_json(self._text(name), self._place(name)).burning(self.aircraft().fuel.heat)

    def service_h(self) -> dict[str, float]:
        """By mount, the hours that the calibration file gives it."""
        calibration = self.calibration()
        return {m.name: calibration.of(m.name).service_h if calibration else 0.0 for m in self.config.mount}

    def calibrated_by(self, text: str, name: str = "calibration.toml") -> "Installation":
        """The same with another calibration file, of this name in the configuration."""
        config = msgspec.structs.replace(self.config, calibration=name)
        return Installation(config, {**self.files, name: text.encode()}, self.where)

    def calibration(self) -> Calibration | None:
        """What was measured of the mounts in this aircraft; None: nothing was."""
        name = self.config.calibration
        if name is None:
            return None
        found = read_calibration(self._text(name), self._place(name))
        check_names(found, self.config, self._place(name))
        return found

    def aircraft(self) -> AircraftData:
        name = self.config.aircraft.data or DATA
        aircraft = read_aircraft(self._text(name), self._place(name))
        most = max(len(self.config.mounts_of(engine)) for engine in self.config.aircraft.engines)
        if len(aircraft.spring_n_mm) < most:
            said = f"{self._place(name)}: spring_n_mm: {len(aircraft.spring_n_mm)} numbers"
            raise ConfigError(f"{said}, expected one for each of {most} mounts")
        specs = [read_model(self.files[mount.model], self._place(mount.model)) for mount in self.config.mount]
        return as_calibrated(as_estimated(placed(aircraft, self.config, self._place(name)), specs), self.calibration())

    def uncorrected(self) -> list[str]:
        """A line for each mount whose model leaves a load factor uncorrected, or which is without the other one."""
        held, lines = len(self.aircraft().spring_n_mm), []
        for mount in self.config.mount:
            if len(self.config.mounts_of(mount.engine)) < held:
                said = f"of {held} mounts the only one with a transducer, its force counts as"
                lines.append(f"{mount.name}: {said} {100.0 * self.place(mount.name).share:.0f} % of the thrust")
            spec = read_model(self.files[mount.model], self._place(mount.model))
            words = {effect_named(effect.name).word for effect in spec.effects}
            absent = [name for name in LOAD_FACTORS if name not in words]
            if absent:
                named = " and no ".join(absent)
                lines.append(f"{mount.name}: {mount.model} has no {named}: the engine's load factor counts as thrust")
        return lines

    def heard(self) -> CanTable:
        """The messages that the pipeline listens to."""
        return self.can_table(_rows(self.config, self._text(self.config.can.dbc), self.where))

    def can_table(self, rows: tuple[CanRow, ...]) -> CanTable:
        units = section(self.config.can.units, CanUnits, f"{self.where}: can.units")
        return CanTable.from_dbc(self._text(self.config.can.dbc), rows, units, self._place(self.config.can.dbc))

    def hashes(self) -> dict[str, str]:
        """SHA-256 of every file, by name."""
        return {name: hashlib.sha256(content).hexdigest() for name, content in self.files.items()}

    def log_header(self, **about: Any) -> LogHeader:
        """Header of a log of this installation; `about`: further fields of LogHeader."""
        return LogHeader(
            engines=tuple(self.config.aircraft.engines),
            mounts=tuple(mount.name for mount in self.config.mount),
            files={name: content.decode() for name, content in self.files.items()},
            sha256=self.hashes(),
            versions={name: version(name) for name in ("thrustd", "numpy", "numba")},
            **about,
        )

    def bench_model(self, mount: Mount) -> ModelSpec:
        """As its bench left it."""
        where = self._place(mount.model)
        spec = read_proven_model(self.files[mount.model], where)
        _check_units(spec, where)
        return spec

    def model(self, mount: Mount) -> ModelSpec:
        """As it flies: with what was measured of this mount."""
        return calibrated(self.bench_model(mount), self.place(mount.name), self._place(mount.model))

    def place(self, mount: str) -> MountPlace:
        """Of a mount by its name, with what was measured of it there."""
        return place_of(mount, self.config, self.aircraft(), self.calibration())

    def others_of(self, mount: str) -> tuple[tuple[MountPlace, ModelSpec], ...]:
        """The other mounts of its engine, with their models as the bench left them."""
        engine = self.place(mount).engine
        others = [one for one in self.config.mount if one.engine == engine and one.name != mount]
        return tuple((self.place(one.name), self.bench_model(one)) for one in others)

    def _text(self, name: str) -> str:
        try:
            return self.files[name].decode()
        except UnicodeDecodeError:
            raise ConfigError(f"{self._place(name)}: not a text file") from None

    def _place(self, name: str) -> str:
        return f"{self.where}: {name}"


class WarmStart(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The state that a run takes over from the one before."""

    snapshot: dict[str, Any] | None  # None: it starts cold
    shift_ns: int = 0  # added to its times
    service_s: tuple[float, ...] = ()  # with a cold start: what the mounts had served before; empty: as calibrated


def read_installation(path: Path | str, trust: Path | None = None) -> Installation:
    """Read a configuration file and every file it names, relative to it.

    `trust`: public key (PEM) of whom the signature beside the configuration has to be; None = it is not asked for.
    """
    path = Path(path)
    content = _read(path, str(path))
    config = _parse(content, str(path))

    def fetch(name: str) -> bytes:
        if name == DATA and config.aircraft.data is None:
            return _shipped_data()
        return _read(path.parent / name, f"{path}: {name}")

    installation = _complete(config, content, fetch, str(path))
    if trust is not None:
        key, signature = _read(trust, f"--trust {trust}"), fetch(path.name + SIGNATURE)
        check_signature(manifest(installation.hashes()), signature, key, str(path))
    return installation


def _check_line(config: Config, where: str) -> None:
    """The serial line of an ADC must carry what it samples; one behind a URL has no rate of its own."""
    frame_bytes = len(encode(0, 0, (0,) * config.adc.channels))
    needed = BITS_PER_BYTE * frame_bytes * config.adc.sample_hz
    if "://" not in config.adc.port and config.adc.baud < needed:
        raise ConfigError(
            f"{where}: adc.baud = {config.adc.baud}: expected at least {needed:.0f} for "
            f"{config.adc.sample_hz:g} frames of {frame_bytes} bytes per second"
        )


def installation_from_files(files: Mapping[str, bytes], where: str) -> Installation:
    """The installation kept in a log; `where` names the log."""
    if CONFIG not in files:
        raise LogError(f"{where}: holds no configuration; give one with --config")
    config = _parse(files[CONFIG], f"{where}: {CONFIG}")

    def fetch(name: str) -> bytes:
        if name == DATA and name not in files:  # a log of before there were such files
            return _shipped_data()
        if name not in files:
            raise LogError(f"{where}: holds no {name}; give a configuration with --config")
        return files[name]

    return _complete(config, files[CONFIG], fetch, where)


def _shipped_data() -> bytes:
    path = shipped(f"deploy/{DATA}", "aircraft.data")
    return _read(path, str(path))


def _complete(config: Config, content: bytes, fetch: Callable[[str], bytes], where: str) -> Installation:
    models = [mount.model for mount in config.mount]
    names = [config.deck, config.can.dbc, *models, config.aircraft.data or DATA]
    names += [config.calibration] if config.calibration is not None else []
    return Installation(config, {CONFIG: content, **{name: fetch(name) for name in names}}, where)


def _parse(content: bytes, where: str) -> Config:
    try:
        return read_config(content.decode(), where)
    except UnicodeDecodeError:
        raise ConfigError(f"{where}: not a text file, expected TOML") from None


def _read(path: Path, where: str) -> bytes:
    return read_plain(path, MAX_FILE_BYTES, ConfigError, where)


def _rows(config: Config, dbc: str, where: str) -> tuple[CanRow, ...]:
    if not config.can.input:
        return (*ICD_INPUT_ROWS, *(row for row in ICD_OPTIONAL_ROWS if f" SG_ {row.dbc} " in dbc))
    rows = [section(row, CanRow, f"{where}: can.input[{i}]") for i, row in enumerate(config.can.input)]
    engines = range(len(config.aircraft.engines))
    needed = {("n1_pct", e) for e in engines} | {(name, 0) for name in ("mach", "pressure_altitude_m", "sat_degC")}
    missing = sorted(needed - {(row.signal, row.index) for row in rows})
    if missing:
        raise ConfigError(f"{where}: can.input: no row for {missing[0][0]} index {missing[0][1]}, which the deck needs")
    return tuple(rows)


def _check_units(spec: ModelSpec, where: str) -> None:
    """An artifact carries no unit: a range that no mount has was identified in another one."""
    for key, (low, high), signal in (
        ("valid.deformation_mm", spec.valid.deformation_mm, CATALOGUE["deformation_mm"]),
        ("valid.force_n", spec.valid.force_n, CATALOGUE["force_N"]),
    ):
        if low < signal.low or high > signal.high:
            span = f"{signal.low:g} to {signal.high:g} {signal.unit}"
            raise ModelError(f"{where}: {key} = {low:g} to {high:g}: expected inside {span}; was it another unit?")


def _check_channels(model: CompiledModel, heard: set[tuple[str, int]], scopes: Mapping[str, int], where: str) -> None:
    for name in sorted({*model.channels[1:]} - {*DERIVED, "deformation_mm"}):
        if name not in CATALOGUE or (name, scopes.get(CATALOGUE[name].scope, 0)) not in heard:
            raise ModelError(f"{where}: needs channel '{name}', which the CAN table does not deliver in flight")
        if not CATALOGUE[name].rests:
            raise ModelError(f"{where}: needs channel '{name}', of which nothing is known before it is heard")
