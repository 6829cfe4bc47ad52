"""Text files as exporters write them."""

from __future__ import annotations

UTF16 = b"\xff\xfe", b"\xfe\xff"
# what surrogateescape makes of bytes that are not UTF-8 (PEP 383), as letters of ISO 8859-1, so that no two become one
WESTERN = {0xDC00 + byte: byte for byte in range(0x80, 0x100)}


def decoded(data: bytes) -> str:
    """A text in UTF-16 or UTF-8, by the mark at its beginning; without one it is UTF-8, and what is not is ISO 8859-1. Its lines
    end with a line feed each."""
    if data.startswith(UTF16):
        text = data.decode("utf-16", "replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("utf-8-sig", "surrogateescape").translate(WESTERN)
    return text.replace("\r\n", "\n").replace("\r", "\n")
