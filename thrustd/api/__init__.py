"""The verbs as functions."""

from thrustd.core.jit import say_compiling

say_compiling()  # before anything that is compiled is imported: a script is silent for long enough
