"""The verbs: parse, call one function, print, return the exit status.

0 done        1 the answer is no (e.g. `extend` found no improvement)        2 bad input, one line on standard error
"""
