"""What is known of a type of aircraft, from its own TOML file: masses, spring rates, what its sensors never do.

`deploy/citation-ii.toml` is one, every number with its origin. Another type is another file.
"""

from collections.abc import Sequence
from math import hypot, inf, radians
from typing import Annotated, NamedTuple

import msgspec
from msgspec import Meta

from thrustd.core.calibration import Calibration, MountCalibration
from thrustd.core.config import Config, Section, read_toml
from thrustd.core.errors import ConfigError, RecordingError
from thrustd.core.signals import STANDARD_GRAVITY_M_S2
from thrustd.core.statics import carried, held

NO_MOUNT = -1
DATA = "citation-ii.toml"  # for configurations that name none
Positive = Annotated[float, Meta(gt=0, le=1e9)]
NotNegative = Annotated[float, Meta(ge=0, le=1e6)]
Place = Annotated[float, Meta(ge=-1e5, le=1e5)]
ANY_MASS_KG = 1.0, 1e6
Arm = Annotated[float, Meta(ge=-20, le=20)]  # m: farther away is another unit


class SensorLimits(Section, frozen=True):
    """What a healthy sensor never does, per 0.1 s step; the file says what each number is."""

    jump: Positive
    noise: Annotated[float, Meta(gt=0)]
    stuck_s: Annotated[float, Meta(gt=0)]
    rate: Annotated[float, Meta(gt=0)] = inf
    low: float = -inf
    high: float = inf
    alone_jump: Annotated[float, Meta(gt=0)] = inf  # of older files and logs; the bank weighs who jumps alone
    moves: Annotated[float, Meta(gt=0)] = inf


class KnownPolar(Section, frozen=True):
    """What somebody else found."""

    zero_lift_drag: Positive
    oswald: Positive
    source: str


class Wing(Section, frozen=True):
    """What lift and drag coefficients are made of; the file says where each number is from."""

    area_m2: Positive
    span_m: Positive
    accel_x_std_g: Positive  # one sigma of the zero of the longitudinal accelerometer against pitch and flight path
    mass_kg: tuple[Positive, Positive] = ANY_MASS_KG  # least and largest of the aircraft in flight
    known: tuple[KnownPolar | str, ...] = ()  # polars of others, to lay beside ours; sentences: of older files

    @property
    def aspect_ratio(self) -> float:
        return self.span_m**2 / self.area_m2


class FuelErrors(Section, frozen=True):
    """What is not sure about a fuel flow in kg/s, relative, one sigma each; the file says where each number is from."""

    meter: NotNegative  # of the transmitter, as a volume
    density: NotNegative  # of the fuel on board, against the one that the transmitter's kg/s stand for
    heating_value: NotNegative  # of the fuel on board, against the brochure's

    @property
    def mass(self) -> float:
        """Of the mass that flows."""
        return hypot(self.meter, self.density)

    @property
    def thrust(self) -> float:
        """Of the mass flow that a deck should have been asked for."""
        return hypot(self.mass, self.heating_value)

    @property
    def heat(self) -> float:
        """Of the heat, which makes the thrust, for a meter without error."""
        return hypot(self.density, self.heating_value)


class InstallationErrors(Section, frozen=True):
    """What an installation may do to the mounts of an engine that no bench has shown; one sigma each.

    Nobody corrects it, so it is in every band. Who has measured a part of it on an aircraft states what is left.
    """

    zero_n: NotNegative  # transducers' zeros once calibrated, weight of a canted mount
    scale: NotNegative  # of the transducers' line
    drag_m2: NotNegative  # what the mounts carry of the nacelle's drag, over dynamic pressure
    rest_n: NotNegative
    temperature_n: NotNegative = 0.0  # growth between transducers and mounts; of older files: in zero_n
    share: Annotated[float, Meta(gt=0, le=0.2)] = 0.006  # of the load that one mount carries
    mass_kg: NotNegative | None = None  # in the models' inertia; none: engine_mass_std_kg
    told_scale: NotNegative = 0.0  # left of the scale by a tethered run: the mounts' own sigma has it, `scale` nothing
    before: tuple[NotNegative, NotNegative] = (0.0, 0.0)  # zero with temperature, N, and scale: before that run

    def terms_n(self, thrust_n: float, pressure_pa: float) -> dict[str, float]:
        """Those that the aircraft's file states here, but for share and mass, at a thrust and a dynamic pressure."""
        return {
            "zero": self.zero_n,
            "temperature": self.temperature_n,
            "scale": self.scale * abs(thrust_n),
            "drag": self.drag_m2 * pressure_pa,
            "rest": self.rest_n,
        }


UNKNOWN = InstallationErrors(zero_n=200.0, scale=0.03, drag_m2=0.04, rest_n=30.0)  # of files and logs that say nothing


class Installed(NamedTuple):
    """What an installation may do to the mounts of an engine, one sigma each, as compiled code takes it."""

    zero_n: float  # warm or cold
    scale: float
    drag_m2: float
    rest_n: float
    cant_n_g: float  # per g of load factor beyond 1
    inertia_n_g: float  # per g along the engine
    share: float  # to opposite sides of both mounts, as the couple: a sum does not need them
    couple_n_g: float  # per g of load factor beyond 1
    told_scale: float = 0.0  # in the mounts' own sigma; here for who doubts it
    zero_before_n: float = 0.0  # before a run has told zeros and scales
    scale_before: float = 0.0


class Windmilling(Section, frozen=True):
    """Of one engine that burns nothing in flight: `brochure.windmilling`; the file says where each number is from."""

    nozzles_m2: Positive
    speed_ratio: Annotated[float, Meta(gt=0, lt=1)]  # of the air in them over flight
    std: NotNegative  # relative

    @property
    def area_m2(self) -> float:
        """Over dynamic pressure, at low speed."""
        return 2.0 * self.nozzles_m2 * self.speed_ratio * (1.0 - self.speed_ratio)


class Cant(Section, frozen=True):
    """How the axis of mounts leans against that of their engine."""

    deg: Annotated[float, Meta(ge=-20, le=20)]  # nose up +
    std_deg: Annotated[float, Meta(ge=0, le=20)]  # one sigma


class MountGeometry(Section, frozen=True):
    """Where a mount is and how stiff in three directions: x forward, y inboard, z up from the centre of gravity."""

    name: str
    at_mm: tuple[Place, Place, Place]
    spring_n_mm: tuple[NotNegative, NotNegative, NotNegative]


class AircraftData(Section, frozen=True):
    """One type of aircraft."""

    name: str
    engine_mass_kg: Positive
    spring_n_mm: Annotated[list[Positive], Meta(min_length=1, max_length=2)]  # of an engine's mounts, in their order
    limits: dict[str, SensorLimits]  # by signal
    engines: Annotated[int, Meta(ge=1, le=8)] = 2  # a polar needs the thrust of all
    engine_mass_std_kg: Annotated[float, Meta(ge=0)] = 0.0
    mounts: tuple[MountGeometry, ...] = ()  # of one engine, the front ones first; what they carry: `core.statics`
    centre_of_gravity_mm: tuple[Place, Place, Place] = (0.0, 0.0, 0.0)  # of an engine, in the axes of mounts.at_mm
    rigid_body: bool = False  # they carry that: a tethered run says so; else they move together and weight is no couple
    cant: dict[str, Cant] = msgspec.field(default_factory=dict)  # by mount of the configuration, or by engine
    # from an engine's centre of gravity to the accelerometer, by engine: forward, right, down; none: not measured
    accelerometer_m: dict[str, tuple[Arm, Arm, Arm]] = msgspec.field(default_factory=dict)
    fuel: FuelErrors = FuelErrors(meter=0.0, density=0.0, heating_value=0.0)
    windmilling: Windmilling | None = None  # none: by the deck's take-off thrust, and less sure
    wing: Wing | None = None  # for the drag polar, and what f_x tells of a lost thrust
    installation: InstallationErrors = UNKNOWN

    def share(self, place: int) -> float:
        """What the mount in this place of `spring_n_mm` carries of its engine's thrust."""
        if self.rigid_body:
            return carried(self)[place].thrust_share
        return self.spring_n_mm[place] / sum(self.spring_n_mm)

    def cant_of(self, mount: str, engine: str) -> Cant | None:
        """Of a mount of the configuration; None: the file says nothing of it."""
        return self.cant.get(mount, self.cant.get(engine))

    def installed(self) -> Installed:
        known = self.installation
        mounts = hypot(known.zero_n, known.temperature_n), known.scale, known.drag_m2, known.rest_n
        others = self.cant_n_g(), self.inertia_n_g(), known.share, self.couple_n_g()
        return Installed(*mounts, *others, known.told_scale, *known.before)

    def cant_n_g(self) -> float:
        """Of an engine's weight, what nobody knows whether its mounts carry it, one sigma."""
        std_deg = max((each.std_deg for each in self.cant.values()), default=0.0)
        return self.engine_mass_kg * STANDARD_GRAVITY_M_S2 * radians(std_deg)

    def inertia_n_g(self) -> float:
        """What nobody knows of an engine's inertia, N per g along it, one sigma."""
        std_kg = self.installation.mass_kg
        return (self.engine_mass_std_kg if std_kg is None else std_kg) * STANDARD_GRAVITY_M_S2

    def couple_n_g(self) -> float:
        """What nobody knows of the couple that its weight is on two mounts, one sigma; none when they move together."""
        return carried(self)[0].weight_std_n if self.rigid_body else 0.0

    def terms_n(self, thrust_n: float, pressure_pa: float, more_g: float, along_g: float) -> dict[str, float]:
        """What an installation may do, term by term; `more_g`: load factor beyond 1, `along_g`: along the engine."""
        of_cant = {"cant": self.cant_n_g() * abs(more_g)} if self.cant else {}
        return self.installation.terms_n(thrust_n, pressure_pa) | of_cant | {"mass": self.inertia_n_g() * abs(along_g)}


class MountPlace(NamedTuple):
    """Where a mount is, what it carries, and what was measured of it there."""

    mount: str
    engine: str
    number: int  # of the engine, in deck and CAN table
    share: float  # of its engine's thrust, -
    calibration: MountCalibration = MountCalibration()
    drag_m2: float = 0.0  # its part of the nacelle's drag over dynamic pressure, as measured
    weight_n: float = 0.0  # its part of the engine's weight
    lean_deg: float = 0.0  # of its axis, nose up against the engine's
    couple_n: float = 0.0  # what the weight presses on it at 1 g, where its transducer is zero


def read_aircraft(text: str, where: str) -> AircraftData:
    """Parse and check; ConfigError, one line that begins with `where`."""
    data = read_toml(text, AircraftData, where)
    if data.rigid_body and len(data.mounts) < len(data.spring_n_mm):
        raise ConfigError(f"{where}: rigid_body: expected mounts with at_mm and spring_n_mm")
    if data.mounts:
        _check_geometry(data, where)
    return data


def _check_geometry(data: AircraftData, where: str) -> None:
    """What statics can answer: the engine cannot move freely, and its mounts are those of spring_n_mm."""
    named = ", ".join(mount.name for mount in data.mounts)
    if not held(data):
        raise ConfigError(f"{where}: mounts: {named} leave an engine free to move, expected all that hold it")
    along = [mount.spring_n_mm[0] for mount in data.mounts[: len(data.spring_n_mm)]]
    if min(along) <= 0.0 or _order(along) != _order(data.spring_n_mm):
        expected = f"expected those of spring_n_mm = {data.spring_n_mm} first, in this order"
        raise ConfigError(f"{where}: mounts: {named} with {along} N/mm along x: {expected}")
    if len({mount.name for mount in data.mounts}) < len(data.mounts):
        raise ConfigError(f"{where}: mounts: {named}: expected every name once")
    shares = [each.thrust_share for each in carried(data)][: len(along)]
    if data.rigid_body and min(shares) <= 0.0:
        said = " and ".join(f"{100 * share:.0f} %" for share in shares)
        asked = "expected a part of it on each: centre_of_gravity_mm or at_mm is off"
        raise ConfigError(f"{where}: rigid_body: its front mounts would carry {said} of a thrust; {asked}")


def _order(rates: Sequence[float]) -> list[int]:
    return sorted(range(len(rates)), key=rates.__getitem__)


def places(config: Config, data: AircraftData) -> tuple[tuple[int, int], ...]:
    """By engine, the mount of the configuration in each place of `spring_n_mm`; NO_MOUNT: none has a transducer there.

    Mounts stand in that order; where not all of an engine's have a transducer, their names say which they are.
    """
    held, rows = len(data.spring_n_mm), []
    for engine in config.aircraft.engines:
        mine, row = config.mounts_of(engine), [NO_MOUNT, NO_MOUNT]
        for number, i in enumerate(mine):
            row[number if len(mine) == held else _place_named(config.mount[i].name, data.mounts[:held])] = i
        rows.append((row[0], row[1]))
    return tuple(rows)


def _place_named(mount: str, known: Sequence[MountGeometry]) -> int:
    for place, one in enumerate(known):
        if mount.endswith(one.name):
            return place
    ends = " or ".join(one.name for one in known) or "a name under mounts of the aircraft's file"
    raise ConfigError(f"mount {mount}: carries a part of its engine, which one? expected a name that ends with {ends}")


def place_of(mount: str, config: Config, data: AircraftData, measured: Calibration | None = None) -> MountPlace:
    """A mount by its name in the configuration."""
    for i, known in enumerate(config.mount):
        if known.name == mount:
            number = places(config, data)[config.aircraft.engines.index(known.engine)].index(i)
            share = data.share(number)
            place = MountPlace(mount, known.engine, config.aircraft.engines.index(known.engine), share)
            if (cant := data.cant_of(mount, known.engine)) is not None:
                place = place._replace(weight_n=share * data.engine_mass_kg * STANDARD_GRAVITY_M_S2, lean_deg=cant.deg)
            if data.rigid_body:
                place = place._replace(couple_n=carried(data)[number].weight_n)
            if measured is None:
                return place
            area_m2 = measured.drag.m2 if measured.drag else 0.0
            return place._replace(calibration=measured.of(mount), drag_m2=share * area_m2)
    names = ", ".join(known.name for known in config.mount)
    raise RecordingError(f"--mount {mount}: not in the configuration, expected one of {names}")
