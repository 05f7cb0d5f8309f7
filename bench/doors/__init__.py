"""Every attack and every quirk of the outside world, against every door of Khala.

    python -m bench.doors                       all rows, as a table; the exit code is 1 if one of them gets through
    python -m bench.doors --door "khala view"   those of one door
    python -m bench.doors --kind fault          those of one kind: attack, quirk or fault
    python -m bench.doors --jobs 2              in two processes
    python -m bench.doors --list                what would be played
    python -m bench.doors --check               the commands without rows; `make check` runs it

A door is where something comes in that its owner did not write: a command that reads a file, a server, an endpoint that
answers. `rows` says what a row is, `commands` lists the doors of the command line, `registry` says which module has the
rows of which door, `playing` plays them, and each other module has rows.
"""
