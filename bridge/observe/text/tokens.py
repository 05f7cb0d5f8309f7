"""About how many tokens a text has, without the tokenizer of any model.

Tokenizers differ, but all of them take common English words as one token, up to three digits as one, and most signs
as one each. So letters are counted in groups, digits in threes and signs singly, and what is no ASCII as a token a
character. Constants are estimates: they are meant to be a little too high for observations, which are full of tags
and numbers, where the usual rule of four characters a token is far too low.
"""

from __future__ import annotations

import math
import string

_LETTERS_PER_TOKEN = 4.4
_DIGITS_PER_TOKEN = 2.2
_SIGNS_PER_TOKEN = 1.3

_NO_LETTERS = {ord(sign): None for sign in string.ascii_letters + " "}
_NO_DIGITS = {ord(sign): None for sign in string.digits}


def tokens(text: str) -> int:
    """About how many tokens a text has; 0 for an empty one."""
    rest = text.translate(_NO_LETTERS)
    signs = rest.translate(_NO_DIGITS)
    ascii_signs = len(signs.encode("ascii", "ignore"))
    spaces = text.count(" ")
    letters, digits, foreign = len(text) - len(rest) - spaces, len(rest) - len(signs), len(signs) - ascii_signs
    return math.ceil(
        letters / _LETTERS_PER_TOKEN + digits / _DIGITS_PER_TOKEN + ascii_signs / _SIGNS_PER_TOKEN + foreign
    )
