"""What can go wrong. Messages name the parameter, its value and how to mend it."""


class EndowireError(Exception):
    """Any error of endowire."""


class InputError(EndowireError, ValueError):
    """A file or a value cannot be used."""


class ComputationError(EndowireError, RuntimeError):
    """A computation did not reach its result on good input."""


class EndOfWay(EndowireError):
    """The instruments can go no farther: the tip has left the vessel, or the vessel is narrower than they are."""
