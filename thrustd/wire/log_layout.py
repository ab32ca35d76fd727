"""What a flight log says about itself: the header, the topics and the form of their messages.

    /raw                          events as they came, encoding of `event_batch`; replay reads nothing else
    /estimate/<engine>            Estimate        /mount/<mount>    MountOutput
    /reading/<signal>[/<owner>]   Reading         /check/<engine>   CrossCheck
    /terms/<engine>               Terms           /fault            Fault
    /truth/<engine or mount>      what a simulated flight really did

Outputs are JSON objects with a JSON schema, the unit in the field name, so that Foxglove and PlotJuggler plot them as
they are. NaN becomes null. Log time is `t_ns` plus the header's `epoch_offset_ns`; `t_ns` inside the message is the
monotonic time everything is computed with.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, get_type_hints

import msgspec

from thrustd.core.errors import LogError
from thrustd.core.signals import CATALOGUE
from thrustd.core.types import CrossCheck, Estimate, Fault, MountOutput, Output, Reading, Status, Terms

RAW_TOPIC = "/raw"
FAULT_TOPIC = "/fault"
TRUTH_TOPIC = "/truth/"
HEADER_NAME = "thrustd"  # of the metadata record
FORMAT = "thrustd.log.v1"


class LogHeader(msgspec.Struct, frozen=True, kw_only=True):
    """Everything needed to run the log again, stored as text in the metadata record."""

    engines: tuple[str, ...]
    mounts: tuple[str, ...]
    files: dict[str, str] = {}  # name in the configuration -> text of every file the pipeline was built from
    sha256: dict[str, str] = {}  # the same names -> hash
    versions: dict[str, str] = {}  # package -> version
    epoch_offset_ns: int = 0  # UTC [ns since 1970] = t_ns + offset, as known when the run started
    run: str = ""  # all files of one run share it
    part: int = 0  # files of one run, counted from 0
    notes: dict[str, str] = {}

    def to_metadata(self) -> dict[str, str]:
        """Plain texts stay plain, everything else becomes JSON."""
        values = msgspec.to_builtins(self)
        texts = {name: v if isinstance(v, str) else msgspec.json.encode(v).decode() for name, v in values.items()}
        return {"format": FORMAT, **texts}

    @classmethod
    def from_metadata(cls, metadata: dict[str, str]) -> "LogHeader":
        """LogError when the metadata is not one of ours."""
        if "format" not in metadata:
            raise LogError("log header: none; expected a flight log (of a recording: `simulate --recording FILE`)")
        if metadata["format"] != FORMAT:
            raise LogError(f"log header: format {metadata['format']!r}, expected {FORMAT!r}")
        kinds = get_type_hints(cls)
        known = {name: text for name, text in metadata.items() if name in kinds}
        try:
            plain = {name: text if kinds[name] is str else msgspec.json.decode(text) for name, text in known.items()}
            return msgspec.convert(plain, cls)
        except (msgspec.DecodeError, msgspec.ValidationError) as error:
            raise LogError(f"log header: {error}") from None


class EstimateMessage(msgspec.Struct, frozen=True):
    """`types.Estimate` field by field, then its status in words."""

    t_ns: int
    engine: int
    thrust_n: float
    thrust_std_n: float
    thrust_rate_n_s: float
    mount_n: float
    mount_std_n: float
    brochure_n: float
    brochure_std_n: float
    innovation_n: float
    brochure_innovation_n: float
    nis: float
    mount_bias_n: float
    brochure_bias: float
    load_share: float
    status: int
    brochure_nis: float
    status_text: list[str]


class MountMessage(msgspec.Struct, frozen=True):
    t_ns: int
    mount: int
    deformation_mm: float
    force_n: float
    std_n: float


class CrossCheckMessage(msgspec.Struct, frozen=True):
    t_ns: int
    engine: int
    source_residual_n: float
    asymmetry_n: float


class TermsMessage(msgspec.Struct, frozen=True):
    t_ns: int
    engine: int
    calibration_n: float
    zero_n: float
    stiffness_n: float
    friction_n: float
    beyond_n: float
    start_n: float
    share_n: float
    installation_n: float
    fuel_n: float


class ReadingMessage(msgspec.Struct, frozen=True):
    t_ns: int
    value: float


class FaultMessage(msgspec.Struct, frozen=True):
    t_ns: int
    where: str
    kind: str
    active: bool
    count: int


class EngineTruth(msgspec.Struct, frozen=True):
    t_ns: int
    thrust_n: float


class MountTruth(msgspec.Struct, frozen=True):
    t_ns: int
    force_n: float


_JSON_TYPES: dict[Any, dict[str, Any]] = {
    bool: {"type": "boolean"},
    int: {"type": "integer"},
    float: {"type": "number"},
    str: {"type": "string"},
    list[str]: {"type": "array", "items": {"type": "string"}},
}


def json_schema(kind: type[msgspec.Struct]) -> bytes:
    """JSON schema in the subset that plotting tools read."""
    fields = {name: _JSON_TYPES[hint] for name, hint in get_type_hints(kind).items()}
    return msgspec.json.encode({"title": schema_name(kind), "type": "object", "properties": fields})


def schema_name(kind: type[msgspec.Struct]) -> str:
    return f"thrustd.{kind.__name__.removesuffix('Message')}"


class TopicKind(NamedTuple):
    topic: str
    kind: type[msgspec.Struct]


class Topics:
    """Output -> topic and JSON. Names come from the configuration; an unknown index names itself by number."""

    __slots__ = ("_encode", "_engines", "_mounts", "_status_words")

    def __init__(self, engines: tuple[str, ...], mounts: tuple[str, ...]) -> None:
        self._engines, self._mounts = engines, mounts
        self._encode: Callable[[Any], bytes] = msgspec.json.Encoder().encode
        self._status_words: dict[int, list[str]] = {}

    def of(self, output: Output) -> TopicKind:
        """Where `output` belongs."""
        match output:
            case Estimate():
                return TopicKind(f"/estimate/{_name(self._engines, output.engine)}", EstimateMessage)
            case MountOutput():
                return TopicKind(f"/mount/{_name(self._mounts, output.mount)}", MountMessage)
            case CrossCheck():
                return TopicKind(f"/check/{_name(self._engines, output.engine)}", CrossCheckMessage)
            case Terms():
                return TopicKind(f"/terms/{_name(self._engines, output.engine)}", TermsMessage)
            case Reading():
                return TopicKind(self._reading_topic(output), ReadingMessage)
            case Fault():
                return TopicKind(FAULT_TOPIC, FaultMessage)

    def encode(self, output: Output) -> bytes:
        """The JSON object of `output`."""
        if isinstance(output, Reading):
            return self._encode(ReadingMessage(output[0], output[3]))
        if isinstance(output, MountOutput):
            return self._encode(MountMessage(*output))
        if isinstance(output, Estimate):
            return self._encode(EstimateMessage(*output, self._words(output.status)))
        if isinstance(output, CrossCheck):
            return self._encode(CrossCheckMessage(*output))
        if isinstance(output, Terms):
            return self._encode(TermsMessage(*output))
        return self._encode(FaultMessage(*output))

    def fixed(self) -> list[TopicKind]:
        """The topics every log of this aircraft has, whether or not something is said on them."""
        engines = [TopicKind(f"/estimate/{name}", EstimateMessage) for name in self._engines]
        mounts = [TopicKind(f"/mount/{name}", MountMessage) for name in self._mounts]
        checks = [TopicKind(f"/check/{name}", CrossCheckMessage) for name in self._engines]
        terms = [TopicKind(f"/terms/{name}", TermsMessage) for name in self._engines]
        return [*engines, *mounts, *checks, *terms, TopicKind(FAULT_TOPIC, FaultMessage)]

    def of_truth(self, name: str) -> TopicKind:
        """Where the true thrust of an engine or the true force on a mount belongs."""
        return TopicKind(f"{TRUTH_TOPIC}{name}", EngineTruth if name in self._engines else MountTruth)

    def encode_truth(self, name: str, t_ns: int, value_n: float) -> bytes:
        """The JSON object of it."""
        return self._encode((EngineTruth if name in self._engines else MountTruth)(t_ns, value_n))

    def _reading_topic(self, reading: Reading) -> str:
        signal = CATALOGUE.get(reading.signal)
        owners = {"engine": self._engines, "mount": self._mounts}.get(signal.scope if signal else "aircraft")
        path = f"/reading/{reading.signal}"
        return path if owners is None else f"{path}/{_name(owners, reading.index)}"

    def _words(self, status: int) -> list[str]:
        words = self._status_words.get(status)
        if words is None:
            words = self._status_words[status] = [str(bit.name) for bit in Status(status)]
        return words


def _name(names: tuple[str, ...], index: int) -> str:
    return names[index] if 0 <= index < len(names) else str(index)
