"""Numbers that Python shares with scripts and kernels."""

from mplicits.web import constants


def test_the_scripts_have_python_s_numbers() -> None:
    """`python -m mplicits.web.constants` writes the file."""
    assert constants.FILE.read_text("utf-8") == constants.text()
