"""Text from files, made safe to stand among other text."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence

_CONTROLS = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ufffe\uffff\ud800-\udfff]")
"""What no text of a page may hold."""

_DIRECTIONS = re.compile("[\u200e\u200f\u202a-\u202e\u2066-\u2069]")
_BEGIN, _END = "\u2068", "\u2069"
_RIGHT_TO_LEFT = frozenset({"R", "AL", "AN"})


def clean(text: str) -> str:
    r"""Return text whose control characters are replaced.

    >>> clean("a\x00b")
    'a�b'
    """
    return _CONTROLS.sub("\ufffd", text)


def isolate(text: str) -> str:
    r"""Return text that cannot turn the direction of what stands around it.

    >>> isolate("plan"), isolate("\u202eplan") == "\u2068plan\u2069"
    ('plan', True)
    """
    bare = _DIRECTIONS.sub("", clean(text))
    turned = any(unicodedata.bidirectional(c) in _RIGHT_TO_LEFT for c in bare)
    return f"{_BEGIN}{bare}{_END}" if turned or bare != text else text


def shown(value: object) -> object:
    """Return a value as a page may show it; what is marked as HTML stays."""
    if not isinstance(value, str) or hasattr(value, "__html__"):
        return value
    return clean(value) if _BEGIN in value else isolate(value)


def listed(texts: Sequence[str]) -> str:
    """Return texts as a list in a sentence.

    >>> listed(["a"]), listed(["a", "b", "c"])
    ('a', 'a, b and c')
    """
    return " and ".join([", ".join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)
