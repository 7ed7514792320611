"""What goes wrong, with the words that the program prints."""


class Error(Exception):
    """Everything that servobee refuses or fails at."""

    def __init__(self, message, place="", problem="", remedy=""):
        super().__init__(message)
        self.place = place
        self.problem = problem
        self.remedy = remedy


class InputError(Error, ValueError):
    """What was given is wrong: a file, a cell, an option."""


class RunError(Error, RuntimeError):
    """The run itself has failed."""


def refused(place, problem, remedy):
    """The exception for what was given wrongly."""
    return InputError(f"{place}: {problem}; {remedy}", place, problem, remedy)
