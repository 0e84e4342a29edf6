"""Exceptions. Messages name the parameter, its value and the remedy."""


class EndowireError(Exception):
    """Any error of endowire."""


class InputError(EndowireError, ValueError):
    """A file or a value cannot be used."""


class ComputationError(EndowireError, RuntimeError):
    """A computation failed on valid input."""


class EndOfWay(EndowireError):
    """The instruments cannot advance: the tip has left the vessel, or the vessel is narrower than they are."""

    #: What the end is: "blocked" where the vessel is too narrow, "left" behind an opening, or "failed" if it is not known.
    ended_by: str = "failed"
