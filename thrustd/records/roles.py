"""Columns of anyone's file in the two roles that every estimation reads, and what the file calls and measures them in.

`deformation_mm` and `force_N` are the names of the roles. A recording whose columns are called otherwise carries their
names in its metadata, so that every report speaks of `Load [kN]` and prints no newton beside it.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from thrustd.core.errors import RecordingError
from thrustd.records.recording import Recording, unit_of
from thrustd.records.rename import AS_NAMED, UNITS_KEY
from thrustd.records.units import unit_in_brackets

INPUT, OUTPUT = "deformation_mm", "force_N"
_INPUT_KEY, _OUTPUT_KEY = "input column", "output column"
COLUMNS = "columns"  # of a model's provenance: input, output


class Roles(NamedTuple):
    """The columns of a file that are the model's input and output."""

    input: str = INPUT
    output: str = OUTPUT

    @property
    def input_unit(self) -> str:
        """As the name says it; empty when it says none."""
        return unit_in_name(self.input)

    @property
    def output_unit(self) -> str:
        return unit_in_name(self.output)

    @property
    def unit(self) -> str:
        """Of the output, for people; the column in whose unit it is, where the name says none."""
        return self.output_unit or f"({self.output})"

    def measured_in(self, unit: str) -> str:
        """A unit of an effect's parameter, in newtons and millimetres, as it is in this file."""
        if self.own:
            return unit
        named = {"N": self.unit, "mm": self.input_unit or f"({self.input})"}
        return re.sub(r"[^ /]+", lambda found: named.get(found[0], found[0]), unit)

    @property
    def own(self) -> bool:
        """Whether it is a mount's file, in millimetres and newtons."""
        return self == Roles()

    def by_column(self, ranges: Mapping[str, object]) -> dict[str, object]:
        """A model's valid ranges by the names of the file's columns; of its own file as they are."""
        rate = f"rate of {self.input}" + (f", {self.input_unit}/s" if self.input_unit else "")
        names = {} if self.own else {INPUT: self.input, "force_n": self.output, "rate_mm_s": rate}
        return {names.get(name, name): range_ for name, range_ in ranges.items()}

    def in_words(self, line: str) -> str:
        """A sentence about the roles, by the names of the file."""
        return line.replace(INPUT, self.input).replace(OUTPUT, self.output)


def unit_in_name(column: str) -> str:
    """`kN` of `load_kN` or `Load [kN]`; empty where a name says none."""
    return unit_of(column) or unit_in_brackets(column)


def with_roles(record: Recording, roles: Roles) -> Recording:
    """The chosen columns under the names of the roles (and under these only); RecordingError when one is not there."""
    if roles.input == roles.output:
        raise RecordingError(f"{record.name}: {roles.input!r} is input and output; expected two columns")
    chosen = {INPUT: record[roles.input], OUTPUT: record[roles.output]}
    others = {name: column for name, column in record.channels.items() if name not in roles}
    said = record.metadata | {_INPUT_KEY: roles.input, _OUTPUT_KEY: roles.output}
    return replace(record, channels=others | chosen, metadata=said)


def roles_of(records: Sequence[Recording]) -> Roles:
    """What the file of the first recording calls the columns."""
    said = records[0].metadata if records else {}
    return Roles(said.get(_INPUT_KEY, INPUT), said.get(_OUTPUT_KEY, OUTPUT))


def roles_in(provenance: Mapping[str, object]) -> Roles:
    """What the files that a model was identified from call the columns."""
    said = provenance.get(COLUMNS)
    return Roles(*map(str, said)) if isinstance(said, list) and len(said) == len(Roles()) else Roles()


def with_trusted_units(record: Recording) -> Recording:
    """The same, its columns taken to be in the units of their names whatever their size."""
    return replace(record, metadata=record.metadata | {UNITS_KEY: AS_NAMED})


def units_trusted(record: Recording, column: str | None = None) -> bool:
    """Whether somebody said the unit: of every column, or of this one, which was converted while it was read."""
    return AS_NAMED in (record.metadata.get(UNITS_KEY), record.metadata.get(f"{UNITS_KEY} {column}"))
