"""The one exception that reaches the user as a single line."""


class UserError(Exception):
    """Something that the user can mend; its text is one line that says what is wrong and what to do.

    The front door prints it on stderr and exits with code 2.
    """
