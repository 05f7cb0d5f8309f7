"""An estimate of the tokens of a text, without the tokenizer of any model.

Tokenizers differ, but all of them take common English words as one token, at most three digits as one, often with
the blank before them as another, and most signs as one each. So letters and digits are counted in groups, signs
singly, and each character outside of ASCII as a token. The sizes of the groups are estimates, made by hand after the
rules of byte-pair encodings: a unit line of 103 characters has about 43 tokens; the usual rule of four characters
for a token says 26.
"""

from __future__ import annotations

import math
import string

_LETTERS_PER_TOKEN = 4.4
_DIGITS_PER_TOKEN = 1.7

_NO_LETTERS = {ord(sign): None for sign in string.ascii_letters + " "}
_NO_DIGITS = {ord(sign): None for sign in string.digits}


def tokens(text: str) -> int:
    """Return the approximate number of tokens of a text; 0 for an empty one."""
    rest = text.translate(_NO_LETTERS)
    signs = rest.translate(_NO_DIGITS)
    ascii_signs = len(signs.encode("ascii", "ignore"))
    spaces = text.count(" ")
    letters, digits, foreign = len(text) - len(rest) - spaces, len(rest) - len(signs), len(signs) - ascii_signs
    return math.ceil(letters / _LETTERS_PER_TOKEN + digits / _DIGITS_PER_TOKEN + ascii_signs + foreign)
