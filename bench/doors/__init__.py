"""Every attack and every quirk of the outside world, against every door of Khala.

    python -m bench.doors                       all rows, as a table; the exit code is 1 if one of them gets through
    python -m bench.doors --door "khala view"   those of one door
    python -m bench.doors --list                what would be played

A door is where something comes in that its owner did not write: a command that reads a file, a server, an endpoint that
answers. `rows` says what a row is, `commands` lists the doors of the command line, and each other module has the
rows of one kind of door.
"""
