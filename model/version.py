"""The version of mplicits that is running."""


def installed_version() -> str:
    """Return the version of the installed package, or the text "(not installed)"."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("mplicits")
    except PackageNotFoundError:
        return "(not installed)"
