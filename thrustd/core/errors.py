"""Everything thrustd raises on purpose.

    ThrustdError                 one clear line, exit status 2
      ConfigError                a configuration file says something impossible
      ModelError                 a model artifact is malformed, or does not reproduce its witness rows
      DeckError                  a brochure deck is malformed
      RecordingError             a data file cannot be used as asked
      LogError                   a flight log cannot be used as asked
      UsageError                 the command line asks for something that does not fit

Bad input *in flight* is never raised: it becomes a `types.Fault` value, is counted, and the flight goes on.
"""

from unicodedata import category

LONGEST_LINE = 2000  # characters


def printable(text: str) -> str:
    """Control characters written out: what a file calls its columns must not steer a terminal."""
    return "".join(ascii(sign)[1:-1] if category(sign)[0] == "C" and sign not in "\n\t" else sign for sign in text)


def one_line(text: str) -> str:
    """As a message is shown: one line, printable, its end left out where it would be many."""
    line = printable(" ".join(text.split()))
    return line if len(line) <= LONGEST_LINE else f"{line[:LONGEST_LINE]} ..."


class ThrustdError(Exception):
    """Base of all. The message is one line: what is wrong, where, and what was expected."""


class ConfigError(ThrustdError):
    """A configuration file says something impossible."""


class ModelError(ThrustdError):
    """A model artifact is malformed, or does not reproduce its witness rows."""


class DeckError(ThrustdError):
    """A brochure deck is malformed."""


class RecordingError(ThrustdError):
    """A data file cannot be used as asked."""


class LogError(ThrustdError):
    """A flight log cannot be used as asked."""


class UsageError(ThrustdError):
    """The command line asks for something that does not fit together."""
