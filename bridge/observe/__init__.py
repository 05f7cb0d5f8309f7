"""What agents see: units → teams → views → text.

`teams` says which unit answers to which agent; `sight` makes the typed view of every team from a snapshot, `events`
compares it with the one before, `text` writes it down with what `knowledge` knows of the types in it. `observer` is
the way through all of it. Everything here is a function of snapshots and of what agents said; no clock, no bus.
"""
