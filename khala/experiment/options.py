"""Options that several commands of `khala experiment` have."""

from pathlib import Path
from typing import Annotated

import typer

OUT = Path("experiments")

Directory = Annotated[Path, typer.Argument(help="Directory of an experiment, or its name below --out.", metavar="DIR")]
Out = Annotated[Path, typer.Option(help="Directory in which each experiment gets its own.", metavar="DIR")]
