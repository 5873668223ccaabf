"""XML as bytes, the same for the same content."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET  # nosec B405: written here, never parsed

_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_REPLACEMENT = "\ufffd"


def plain_text(text: str) -> str:
    r"""Return a text with all characters replaced that XML 1.0 cannot hold, however escaped.

    >>> plain_text("a\x00<b>")
    'a�<b>'
    """
    return _NOT_XML.sub(_REPLACEMENT, text)


def document(root: ET.Element) -> bytes:
    """Return the bytes of a file with one element a line."""
    ET.indent(root, " ")
    return bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"
