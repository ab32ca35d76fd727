"""read, write, load: recordings and models by name, nothing of the user's overwritten."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from thrustd.api.model import Model
from thrustd.api.spoken import spoken
from thrustd.core.errors import UsageError
from thrustd.diagnose.compare.reference import BROCHURE, THRUST, as_mount, with_reference
from thrustd.identify.segments import FORCE
from thrustd.installation.shipped import CONFIGURATION, read_deck, shipped
from thrustd.model.artifact import write_model
from thrustd.model.compile import read_proven_model
from thrustd.records.files import write_recording
from thrustd.records.marks import read_marks, without_excluded
from thrustd.records.recording import Recording
from thrustd.records.rename import read_rename
from thrustd.records.roles import Roles, with_roles
from thrustd.records.time_axis import TimeAxis, read_timed
from thrustd.sinks.whole_file import write_whole
from thrustd.sources.plain_file import TEXT_BYTES, read_plain

if TYPE_CHECKING:
    from thrustd.brochure.deck import Deck
    from thrustd.core.aircraft import MountPlace


@spoken
def read(
    path: str | Path,
    *,
    mount: str = "",
    input: str = "",
    output: str = "",
    time: str = "time_s",
    rate_hz: float | None = None,
    rename: str | Sequence[str] = (),
    against: str = "",
    config: str | Path | None = None,
) -> Recording:
    """A recording of any type: CSV, Parquet, MCAP (flight logs too), npz, mat.

    mount: of a flight, such as "left_upper": its columns under plain names, the reference as `force_N`.
    input, output: columns of anyone's file in the roles of `deformation_mm` and `force_N`.
    time, rate_hz: the column of seconds, or samples per second where there is none.
    rename: columns under other names, units converted: "Load [kN]=force_N*1000", "T [K]=temperature_degC-273.15".
    against: the reference, a column of force, or "brochure". config: of the aircraft, for `mount`.

    Channels are float64 (n,), units in their names. RecordingError, one line, when the file cannot be used as asked.
    """
    path, axis = Path(path), TimeAxis(time, rate_hz)
    renames = [read_rename(text) for text in ([rename] if isinstance(rename, str) else rename)]
    record = read_timed(path, axis, renames)
    record = without_excluded(record, read_marks(path))
    if input or output:
        roles = Roles(*(given or own for given, own in zip((input, output), Roles(), strict=True)))
        record = with_roles(record, roles)
    if not (mount or against):
        return record
    place, deck = _aboard(mount, config) if mount else (None, read_deck() if against == BROCHURE else None)
    record = as_mount(record, place)
    known = against or FORCE in record or THRUST in record
    return with_reference(record, against, place, deck) if known else record


def _aboard(mount: str, config: str | Path | None) -> "tuple[MountPlace, Deck]":
    """The mount in the aircraft that the configuration describes, and the deck of its engines."""
    from thrustd.installation.installation import read_installation  # and with it all that flies

    installation = read_installation(Path(config) if config else shipped(CONFIGURATION, "config"))
    return installation.place(mount), installation.deck()


@spoken
def load(path: str | Path) -> Model:
    """A model artifact (.json), proven against its witness; ModelError when it is none."""
    text = read_plain(Path(path), TEXT_BYTES, UsageError)
    return Model(read_proven_model(text, str(path)))


@spoken
def write(what: Recording | Model, path: str | Path, *, overwrite: bool = False) -> Path:
    """A recording (by extension) or a model (.json), whole or not at all. UsageError when the file already exists."""
    path = Path(path)
    if path.exists() and not overwrite:
        raise UsageError(f"{path}: already exists; expected another name, or overwrite=True")
    if isinstance(what, Recording):
        write_recording(what, path)
        return path
    if path.suffix != ".json":
        raise UsageError(f"{path}: expected a name that ends in .json for a model")
    write_whole(path, write_model(what.spec))
    return path
