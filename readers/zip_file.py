"""Lists the members of a zip archive, whose claims then hold for what is unpacked."""

import zipfile

from ..model.errors import UserError

BOUNDED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)


def members(archive: zipfile.ZipFile) -> list[zipfile.ZipInfo]:
    """Return the members of an archive; read(n) of one then unpacks no more than n bytes, nor than `file_size`.

    Raises UserError for other compressions, of which zipfile unpacks a whole block: 45 bytes may be 45 MB.
    """
    for info in archive.infolist():
        if info.compress_type not in BOUNDED:
            raise UserError("it is packed in a way that is not deflate; write it anew")
    return archive.infolist()
