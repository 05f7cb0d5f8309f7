"""The command line of a benchmark."""

from __future__ import annotations

import argparse


def make_parser(document: str, *, json: bool = True) -> argparse.ArgumentParser:
    """Return a parser whose help is the docstring of a module, with the option `--json` unless told otherwise."""
    parser = argparse.ArgumentParser(description=document, formatter_class=argparse.RawDescriptionHelpFormatter)
    if json:
        parser.add_argument("--json", action="store_true", help="print JSON on stdout, and no table")
    return parser
