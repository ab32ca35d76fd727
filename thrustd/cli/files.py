"""Files named on the command line: read them, or say in one line why not."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any

from thrustd.core.errors import UsageError, printable
from thrustd.sinks.whole_file import write_whole
from thrustd.sources.plain_file import read_text

if TYPE_CHECKING:
    from thrustd.model.artifact import ModelSpec

OUTPUTS = "out", "smooth", "picture", "table", "c", "report"  # arguments that name a file to write


def check_text(arguments: Sequence[str]) -> None:
    """Before anything else: names that no terminal can show, and half of the libraries cannot open, are refused."""
    for text in arguments:
        if printable(text) != text or "\n" in text:
            raise UsageError(
                f"{text!r}: holds control characters or is not UTF-8; expected plain text: rename the file"
            )


def check_outputs(arguments: Mapping[str, Any]) -> None:
    """Before any work: each file to write has a folder, and none of them is a file that is read."""
    given = {name: value if isinstance(value, list) else [value] for name, value in arguments.items()}
    read = [path for name, values in given.items() if name not in OUTPUTS for path in values]
    read = [path for path in read if isinstance(path, Path) and path.exists()]
    makes_folder = arguments.get("job") or arguments.get("hide") or "chamber" in arguments  # when it is not there
    folder = arguments["out"] if makes_folder else None
    for out in (path for name in OUTPUTS for path in given.get(name, []) if isinstance(path, Path)):
        if out.suffix and out is not folder:
            _check_file(out)
        else:
            _try_out(_there(out), f"-o {out}")
        for path in read if out.exists() else ():
            if out.samefile(path) if not path.is_dir() else out.is_file() and out.parent.samefile(path):
                raise UsageError(f"{out}: is an input; expected another name for the output")
    _check_pictures(arguments.get("picture"), arguments.get("pictures"))


def _check_file(out: Path) -> None:
    if not out.parent.is_dir():
        raise UsageError(f"{out}: cannot be written: there is no folder {out.parent}")
    if out.is_dir():
        raise UsageError(f"{out}: cannot be written: it is a folder; expected the name of a file")
    _try_out(out.parent, str(out))


def _check_pictures(picture: Path | None, pictures: Path | None) -> None:
    """`picture` is a file, `pictures` a folder that may have to be made; tried out, for rights do not tell all."""
    if picture is not None and (picture.suffix != ".png" or picture.is_dir()):
        raise UsageError(f"--picture {picture}: expected the name of a file that ends in .png")
    wanted = picture.parent if picture is not None else pictures
    if wanted is None:
        return
    _try_out(_there(wanted), f"--picture {picture}" if picture is not None else f"--pictures {pictures}")


def _there(wanted: Path) -> Path:
    """The nearest folder above that exists."""
    return next(folder for folder in (wanted, *wanted.parents) if os.path.exists(folder))  # never raises


def _try_out(folder: Path, said: str) -> None:
    try:
        with TemporaryFile(dir=folder):
            pass
    except OSError as problem:
        raise UsageError(f"{said}: cannot be written to {folder}: {problem.strerror}; expected a folder") from None


def split_models(files: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Model artifacts (.json) and recordings (anything else); at least one of each."""
    models = [path for path in files if path.suffix == ".json"]
    data = [path for path in files if path.suffix != ".json"]
    if not models or not data:
        raise UsageError(
            f"{len(models)} models (.json) and {len(data)} recordings given; expected at least one of each"
        )
    return models, data


def read_models(paths: Sequence[Path]) -> dict[str, "ModelSpec"]:
    """Models by file name without suffix; a name given twice gets its folder in front."""
    from thrustd.installation.shipped import own_or_shipped
    from thrustd.model.compile import read_proven_model

    specs = {}
    for path in (own_or_shipped(path, "model") for path in paths):
        name = path.stem if path.stem not in specs else str(path.with_suffix(""))
        specs[name] = read_proven_model(read_text(path), str(path))
    return specs


def write_model_file(spec: "ModelSpec", path: Path) -> None:
    """Written whole or not at all."""
    from thrustd.model.artifact import write_model

    write_whole(path, write_model(spec))
