"""What the page may ask the worker to do: validated before it is queued."""

from typing import Annotated, Any, Literal

import msgspec

from thrustd.core.errors import UsageError
from thrustd.workbench.folder import Folder

Names = Annotated[tuple[str, ...], msgspec.Meta(min_length=1, max_length=20)]
Effect = Annotated[str, msgspec.Meta(min_length=1, max_length=200)]


class Order(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag=str.lower):
    """`kind` says which."""


class Prepare(Order, frozen=True):
    """Columns and pyramids of a recording."""

    recording: str


class Simulate(Order, frozen=True):
    """Force and residual of models on a recording, as columns."""

    recording: str
    models: Names


class Replay(Order, frozen=True):
    """Estimates of a flight log, in a new log."""

    recording: str
    out: str


class Exercise(Order, frozen=True):
    """The twin hides an effect nobody is told."""

    strength: Annotated[float, msgspec.Meta(gt=0, le=20)] = 3.0


class Reveal(Order, frozen=True):
    """Open the sealed answer of an exercise."""

    exercise: str


class Fit(Order, frozen=True):
    """Identify a first model."""

    recordings: Names
    out: str


class Condition(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Samples with low <= channel <= high, and force rising or falling if so asked."""

    channel: str = ""
    low: float | None = None
    high: float | None = None
    phase: str = ""  # "loading", "unloading" or "" for both


class Compare(Order, frozen=True):
    models: Names
    recordings: Names
    condition: Condition | None = None


class Diagnose(Order, frozen=True):
    model: str
    recordings: Names


class Extend(Order, frozen=True):
    model: str
    effects: Annotated[tuple[Effect, ...], msgspec.Meta(min_length=1, max_length=6)]
    recordings: Names
    heldout: tuple[str, ...]
    out: str


class Compile(Order, frozen=True):
    """Check that a model is ready to fly."""

    model: str
    rate_hz: Annotated[float, msgspec.Meta(gt=0, le=100_000)]


class Report(Order, frozen=True):
    """A self-contained HTML page of all answers so far."""

    title: Annotated[str, msgspec.Meta(max_length=200)] = ""


class Mass(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A mass sheet: what the aircraft weighs when the log begins."""

    empty_kg: Annotated[float, msgspec.Meta(gt=0, le=1e6)]
    payload_kg: Annotated[float, msgspec.Meta(ge=0, le=1e6)]
    fuel_kg: Annotated[float, msgspec.Meta(ge=0, le=1e6)]
    std_kg: Annotated[float, msgspec.Meta(gt=0, le=1e6)]


class FlightTest(Order, frozen=True):
    """Test points or transients of one flight, drag polar or health of several."""

    question: Literal["points", "performance", "transients", "health"]
    recordings: Annotated[tuple[str, ...], msgspec.Meta(min_length=1, max_length=500)]
    mass: Mass | None = None
    marks: Annotated[str, msgspec.Meta(max_length=200)] = ""


class Panel(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One axes of a figure: its title and its lines, as `api/lines` names them."""

    title: Annotated[str, msgspec.Meta(max_length=200)]
    channels: Annotated[tuple[str, ...], msgspec.Meta(min_length=1, max_length=12)]


class Figure(Order, frozen=True):
    """The visible window as a figure of print size."""

    recording: str
    title: Annotated[str, msgspec.Meta(max_length=300)]
    panels: Annotated[tuple[Panel, ...], msgspec.Meta(min_length=1, max_length=20)]
    start_s: float
    stop_s: float
    format: Literal["png", "svg"] = "png"


Any_ = (
    Figure
    | Prepare
    | Simulate
    | Replay
    | Exercise
    | Reveal
    | Fit
    | Compare
    | Diagnose
    | Extend
    | Compile
    | Report
    | FlightTest
)


def order_of(folder: Folder, body: bytes) -> tuple[str, str, dict[str, Any]]:
    """(kind, title for people, arguments) of a JSON order; UsageError when it cannot be carried out."""
    try:
        order = msgspec.json.decode(body, type=Any_)
    except (msgspec.DecodeError, RecursionError) as problem:
        raise UsageError(f"order: {problem}") from None
    arguments = msgspec.to_builtins(order)
    kind = arguments.pop("kind")
    for field in ("recording", "model"):
        if field in arguments:
            folder.path(arguments[field])
    for field in ("recordings", "models", "heldout"):
        for name in arguments.get(field, ()):
            folder.path(name)
    both = set(arguments.get("heldout", ())) & set(arguments.get("recordings", ()))
    if both:
        raise UsageError(f"{min(both)}: what the effect is fitted to cannot check it; expected another recording")
    if "out" in arguments and folder.new_path(arguments["out"]).exists():
        raise UsageError(f"{arguments['out']}: is already in the folder; choose another name")
    return kind, _title(order), arguments


def _title(order: Any_) -> str:
    """What the page calls the job."""
    fields = {
        name: ", ".join(map(str, value)) if isinstance(value, tuple) else value
        for name, value in msgspec.structs.asdict(order).items()
    }
    return TITLES[type(order)].format(**fields)


TITLES: dict[type[Order], str] = {
    Prepare: "read {recording}",
    Simulate: "run {models} on {recording}",
    Replay: "replay {recording}",
    Exercise: "make a hidden-effect exercise",
    Reveal: "open the sealed answer",
    Fit: "identify {out} from {recordings}",
    Compare: "compare {models} with {recordings}",
    Diagnose: "what is missing in {model}",
    Extend: "add {effects} to {model}",
    Compile: "compile {model} at {rate_hz:g} Hz",
    Figure: "draw {title}",
    Report: "write the report",
    FlightTest: "flight test: {question}",
}
