"""The exception that the user sees as a single line."""


class UserError(Exception):
    """An error that the user can fix. Its text is one line: what is wrong, and what to do.

    The command line prints the text on stderr and exits with code 2.
    """
