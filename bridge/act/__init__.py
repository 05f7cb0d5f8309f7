"""What the words of agents do: recognise → translate → execute.

`catalog` is the table of text actions; `recognise` reads calls by it; `translate` makes commands of them that know
units and world points and no frame; `raw` and `screen` play the same commands in two ways, as plans of steps that
`bridge.game` carries out. `actor` is the way through all of it.
"""
