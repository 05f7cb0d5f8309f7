"""Doubles that ship with Khala: policies that need no model, and an endpoint that needs none either.

`policies` answer in place of a model within a worker. `endpoint` is an HTTP server that speaks OpenAI's chat
completions and plays from the text of the prompt alone (`reading` → `players`), with `faults` on request: what
a match meets in it, it meets in a real one.
"""
