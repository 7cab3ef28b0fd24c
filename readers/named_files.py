"""Finds the files that materials name: programs write paths of other machines, and names in any case."""

import os
import re
from pathlib import Path

from ..model.references import Folder, UnresolvedError


class NamedFiles:
    """The files beside another file, by the names in it; each name and each folder is looked up once."""

    def __init__(self, folder: Folder) -> None:
        """folder: of the file that names others."""
        self._folder = folder
        self._found: dict[str, Path | UnresolvedError] = {}
        self._listed: dict[str, dict[str, str]] = {}

    def file(self, name: str) -> Path:
        """Find a file: at its path, or by its last part beside the file, in any case. Raises UnresolvedError."""
        if name not in self._found:
            try:
                self._found[name] = self._look_for(name)
            except UnresolvedError as error:
                self._found[name] = error
        found = self._found[name]
        if isinstance(found, UnresolvedError):
            raise UnresolvedError(name, found.why)
        return found

    def _look_for(self, name: str) -> Path:
        try:
            return self._folder.file(name)
        except UnresolvedError as error:
            refused = error
        *above, last = [part for part in re.split(r"[\\/]+", name) if part not in ("", ".")] or [""]
        for place in ("/".join(above), ".") if above else (".",):
            spelled = self._names_in(place).get(last.lower())
            if spelled is not None and (found := self._folder.find(f"{place}/{spelled}")) is not None:
                return found
        raise refused

    def _names_in(self, place: str) -> dict[str, str]:
        """Return the names of the files in a folder, by their lower case; none for a folder elsewhere."""
        try:
            folder = os.path.realpath(self._folder.below(place))
            if folder not in self._listed:
                self._listed[folder] = {name.lower(): name for name in sorted(os.listdir(folder), reverse=True)}
        except (OSError, ValueError, UnresolvedError):
            return {}
        return self._listed[folder]
